"""Surrogates of conflict: time to collision and post-encroachment time."""

from __future__ import annotations

from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._outline import Outline
from ._trace import Trace

# Places are compared at no more instants than this; a robot at 1.5 m/s moves 75 mm in between.
_COMPARED_HZ: Final = 20.0
_ROWS_AT_ONCE: Final = 512


def min_time_to_collision_s(
    trace: Trace, outline: Outline, body_radius_m: float = BODY_RADIUS_M
) -> float | None:
    """The smallest time to collision of the episode; None if no course ever led to one.

    At each instant: when outline and body disc would touch if robot and person kept their
    velocities (Hayward 1972). The robot's turning is not extrapolated.
    """
    if not trace.people:
        return None
    relative = trace.people_odom_m - trace.robot_odom_m[:, None, :]
    ahead = np.stack([np.cos(trace.heading_odom_rad), np.sin(trace.heading_odom_rad)], axis=1)
    velocity = trace.people_odom_mps - (trace.speed_mps[:, None] * ahead)[:, None, :]
    times = outline.time_to_disc(
        trace.to_base(relative).reshape(-1, 2),
        trace.to_base(velocity).reshape(-1, 2),
        body_radius_m,
    )
    smallest = float(times.min())
    return smallest if np.isfinite(smallest) else None


def post_encroachment_s(
    trace: Trace, outline: Outline, body_radius_m: float = BODY_RADIUS_M
) -> float | None:
    """The smallest post-encroachment time; None if no place was used by both.

    The time between one of robot and person leaving a place and the other entering it (Allen, Shin
    and Cooper 1978), the smallest over all places and people. A place lies in the robot's outline
    at t and in the body disc at t' exactly if the two overlap, so it is the smallest |t − t'| over
    overlapping poses. The resolution is the time between frames, 0.05 s at 20 or more a second. 0
    means that the outline and the disc overlapped at one instant, which a body, being slimmer,
    need not have felt.
    """
    step = 1
    if len(trace.t_s) > 1:
        step = max(round(1.0 / (_COMPARED_HZ * float(np.median(np.diff(trace.t_s))))), 1)
    t_s, robot, heading = (
        array[::step] for array in (trace.t_s, trace.robot_odom_m, trace.heading_odom_rad)
    )
    reach = float(outline.reach_m + body_radius_m)
    smallest = np.inf
    for person in range(trace.people):
        places = trace.people_odom_m[::step, person]
        for first in range(0, len(t_s), _ROWS_AT_ONCE):
            rows = slice(first, first + _ROWS_AT_ONCE)
            offsets = places[None, :, :] - robot[rows, None, :]
            apart_s = np.abs(t_s[None, :] - t_s[rows, None])
            near = np.einsum("nki,nki->nk", offsets, offsets) < reach**2
            row, column = np.nonzero(near & (apart_s < smallest))
            turned = _turned(offsets[row, column], heading[rows][row])
            overlap = outline.distance(turned) < body_radius_m
            smallest = min(smallest, float(apart_s[row, column][overlap].min(initial=np.inf)))
    return smallest if np.isfinite(smallest) else None


def _turned(vectors_odom: FloatArray, heading_odom_rad: FloatArray) -> FloatArray:
    cos, sin = np.cos(heading_odom_rad), np.sin(heading_odom_rad)
    x, y = vectors_odom.T
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1)
