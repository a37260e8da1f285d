"""A walk through waypoints that is known beforehand: a table of body and feet over time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import uniform_filter1d

from perception.arrays import FloatArray

from ...world.config import SimConfig
from ..body import GaitPose, PlannedGait, plan_footsteps, skeleton

# Below this speed the direction of walking is noise and the body keeps its heading.
_HEADING_FROM_MPS: Final = 0.05
_ROW_STEP_S: Final = 0.01
# A body without heading keys turns along its walk, averaged over this time.
_TURN_SMOOTHING_S: Final = 0.4
# Feet start before the body and stop after it.
_MARGIN_S: Final = 1.5


class Waypoint(SimConfig):
    """Position of the body at a time, in odom.

    Attributes:
        t_s: time from the start of the episode.
        x_m: position.
        y_m: position.
    """

    t_s: float
    x_m: float
    y_m: float


class HeadingKey(SimConfig):
    """Heading of the body at a time, degrees counter-clockwise from odom x.

    Attributes:
        t_s: time from the start of the episode.
        heading_deg: heading, counter-clockwise from odom x.
    """

    t_s: float
    heading_deg: float


@dataclass(frozen=True, slots=True)
class PlannedMotion:
    """The body of a planned walk at one instant.

    Attributes:
        position_odom_m: (2,).
        velocity_odom_mps: (2,).
        heading_odom_rad: heading of the body.
        walked_m: length of the path so far.
        feet: gait pose in odom.
    """

    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    heading_odom_rad: float
    walked_m: float
    feet: GaitPose


class PlannedWalk:
    """A walk through waypoints; the body stands before the first and after the last one.

    Positions and headings are monotone cubics (PCHIP) between their keys.

    Args:
        path: at least one waypoint.
        heading: keys of the heading; none faces along the walk.
        gait: the body's gait.
    """

    def __init__(
        self, path: tuple[Waypoint, ...], heading: tuple[HeadingKey, ...], gait: PlannedGait
    ) -> None:
        first, last = path[0].t_s, path[-1].t_s
        steps = max(math.ceil((last - first) / _ROW_STEP_S), 1)
        # There is a row at the first and at the last waypoint.
        step = (last - first) / steps if last > first else _ROW_STEP_S
        before = math.ceil((max(first - heading[0].t_s, 0.0) if heading else 0.0) / step)
        after = math.ceil((max(heading[-1].t_s - last, 0.0) if heading else 0.0) / step)
        margin = math.ceil(_MARGIN_S / step)
        numbers = np.arange(-before - margin, steps + after + margin + 1)
        times: FloatArray = first + step * numbers.astype(np.float64)
        corners = np.array([[point.x_m, point.y_m] for point in path])
        if len(path) == 1:
            points, velocity = np.repeat(corners, len(times), axis=0), np.zeros((len(times), 2))
        else:
            spline = PchipInterpolator([point.t_s for point in path], corners)
            clipped = np.clip(times, first, last)
            points, velocity = spline(clipped), spline.derivative()(clipped)
            velocity[(numbers < 0) | (numbers > steps)] = 0.0
        facing = _facing(heading, times, velocity, step)
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        walked = np.concatenate([[0.0], np.cumsum(lengths)])
        feet = plan_footsteps(gait, times, points, facing, velocity)
        self._rows = np.column_stack([points, velocity, facing, walked, feet])
        self._start_s, self._step_s = float(times[0]), step
        self._walking_s = (first, last) if len(path) > 1 else (math.inf, -math.inf)

    def motion(self, t_s: float) -> PlannedMotion:
        """Return the body's motion at a time."""
        rows = self._rows
        place = min(max((t_s - self._start_s) / self._step_s, 0.0), len(rows) - 1.0)
        row = min(int(place), len(rows) - 2)
        here: FloatArray = rows[row] + (place - row) * (rows[row + 1] - rows[row])
        heading, walked, *feet = here[4:].tolist()
        walking = self._walking_s[0] <= t_s <= self._walking_s[1]
        return PlannedMotion(
            position_odom_m=here[:2],
            velocity_odom_mps=here[2:4] if walking else np.zeros(2),
            heading_odom_rad=heading,
            walked_m=walked,
            feet=GaitPose((tuple(feet[:5]), tuple(feet[5:10])), *feet[10:]),
        )


@lru_cache(maxsize=64)
def planned_walk(
    path: tuple[Waypoint, ...],
    heading: tuple[HeadingKey, ...],
    look: str | None,
    stature_m: float,
    stride_m: float | None,
) -> PlannedWalk:
    """Plan the walk of a worker; walks with the same arguments share one plan."""
    return PlannedWalk(path, heading, PlannedGait(skeleton(look, stature_m), stride_m))


def _facing(
    heading: tuple[HeadingKey, ...], times: FloatArray, velocity: FloatArray, step_s: float
) -> FloatArray:
    """Return (N,) unwrapped headings: by their keys, else along the walk."""
    if not heading:
        size = 2 * round(0.5 * _TURN_SMOOTHING_S / step_s) + 1
        return np.asarray(uniform_filter1d(_heading_along(velocity), size, mode="nearest"))
    angles = [math.radians(key.heading_deg) for key in heading]
    if len(heading) == 1:
        return np.full(len(times), angles[0])
    keys = [key.t_s for key in heading]
    turn = PchipInterpolator(keys, angles)
    return np.asarray(turn(np.clip(times, keys[0], keys[-1])))


def _heading_along(velocity: FloatArray) -> FloatArray:
    """Return (N,) unwrapped directions of walking, held while the body hardly moves."""
    moving = np.flatnonzero(np.linalg.norm(velocity, axis=1) > _HEADING_FROM_MPS)
    if not len(moving):
        return np.zeros(len(velocity))
    place = np.searchsorted(moving, np.arange(len(velocity)))
    nearest = moving[np.clip(place, 0, len(moving) - 1)]
    return np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0])[nearest])
