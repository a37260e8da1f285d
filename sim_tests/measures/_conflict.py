"""Surrogates of conflict: time to collision and post-encroachment time."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._outline import Outline
from ._trace import Trace

# Poses are compared at so many instants a second; a robot at 1.5 m/s moves 75 mm in between.
_COMPARED_HZ: Final = 20.0
# So many of the nearest pairs are looked at again at so many instants about theirs.
_REFINED: Final = 8
_FINER: Final = 11
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
    overlapping poses. Poses are compared every 0.05 s and, about the nearest of them, every 0.01 s
    on straight lines in between. 0 means that the outline and the disc overlapped at one instant,
    which a body, being slimmer, need not have felt.
    """
    step = 1
    if len(trace.t_s) > 1:
        step = max(round(1.0 / (_COMPARED_HZ * float(np.median(np.diff(trace.t_s))))), 1)
    smallest = np.inf
    for person in range(trace.people):
        paths = _Paths(trace, person, outline, body_radius_m)
        t_s = trace.t_s[::step]
        for first in range(0, len(t_s), _ROWS_AT_ONCE):
            robot_s = t_s[first : first + _ROWS_AT_ONCE]
            robot_row, person_row, apart_s = paths.overlaps(robot_s, t_s, smallest)
            for best in np.argsort(apart_s, kind="stable")[:_REFINED]:
                fine = paths.overlaps(
                    paths.around(robot_s[robot_row[best]]),
                    paths.around(t_s[person_row[best]]),
                    smallest,
                )[2]
                smallest = min(smallest, float(apart_s[best]), float(fine.min(initial=np.inf)))
    return smallest if np.isfinite(smallest) else None


class _Paths:
    """Robot's and one person's way, at any instant."""

    def __init__(self, trace: Trace, person: int, outline: Outline, body_radius_m: float) -> None:
        self._t_s = trace.t_s
        self._heading_rad = np.unwrap(trace.heading_odom_rad)
        self._robot_m = trace.robot_odom_m
        self._person_m = trace.people_odom_m[:, person]
        self._outline = outline
        self._radius_m = body_radius_m

    def around(self, t_s: float) -> FloatArray:
        """Instants about one."""
        fine = t_s + np.linspace(-1.0, 1.0, _FINER) / _COMPARED_HZ
        there: FloatArray = fine[(fine >= self._t_s[0]) & (fine <= self._t_s[-1])]
        return there

    def overlaps(
        self, robot_s: FloatArray, person_s: FloatArray, less_than_s: float
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
        """Rows of both instants whose poses overlap, and the time between them."""
        robot, person = self._at(robot_s, self._robot_m), self._at(person_s, self._person_m)
        offsets = person[None, :, :] - robot[:, None, :]
        apart_s = np.abs(person_s[None, :] - robot_s[:, None])
        reach = self._outline.reach_m + self._radius_m
        near = np.einsum("nki,nki->nk", offsets, offsets) < reach**2
        row, column = np.nonzero(near & (apart_s < less_than_s))
        turned = _turned(
            offsets[row, column], np.interp(robot_s, self._t_s, self._heading_rad)[row]
        )
        kept = self._outline.distance(turned) < self._radius_m
        row, column = row[kept], column[kept]
        return row, column, apart_s[row, column]

    def _at(self, t_s: FloatArray, path_m: FloatArray) -> FloatArray:
        return np.stack([np.interp(t_s, self._t_s, path_m[:, axis]) for axis in (0, 1)], axis=1)


def _turned(vectors_odom: FloatArray, heading_odom_rad: FloatArray) -> FloatArray:
    """(N, 2) vectors in the axes of a base frame each."""
    cos, sin = np.cos(heading_odom_rad), np.sin(heading_odom_rad)
    x, y = vectors_odom.T
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1)
