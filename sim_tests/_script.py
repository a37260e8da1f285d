"""What a scripted worker does: where he walks, which way he faces, where he looks."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator
from scipy.interpolate import PchipInterpolator

from perception.arrays import FloatArray
from tracking.config import StrictConfig

from ._errors import SimError

# Below this speed the direction of walking is noise and the body keeps its heading.
_TURNING_SPEED_MPS = 0.05
_TABLE_STEP_S = 0.01


class Waypoint(StrictConfig):
    """Where the worker's body is at a time; metres in odom."""

    error: ClassVar[type[ValueError]] = SimError

    t_s: float
    x_m: float
    y_m: float


class HeadingKey(StrictConfig):
    """Which way the body faces at a time, degrees counter-clockwise from odom x."""

    error: ClassVar[type[ValueError]] = SimError

    t_s: float
    heading_deg: float


class GazeKey(StrictConfig):
    """Where the head points at a time.

    ``look: ahead`` is the way the body faces, ``look: robot`` the robot's camera; ``yaw_deg`` turns
    away from that to the left, ``pitch_deg`` up. From one key to the next the head turns smoothly.
    """

    error: ClassVar[type[ValueError]] = SimError

    t_s: float
    look: Literal["ahead", "robot"] = "ahead"
    yaw_deg: float = 0.0
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0)


@dataclass(frozen=True, slots=True)
class WorkerMotion:
    """The scripted body at one instant.

    Attributes:
        position_odom_m: (2,).
        velocity_odom_mps: (2,).
        heading_odom_rad: the way the body faces.
        walked_m: length of the path so far, for the gait.
    """

    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    heading_odom_rad: float
    walked_m: float


class WorkerScript(StrictConfig):
    """A worker's walk and gaze.

    Attributes:
        stature_m: body height.
        stride_m: distance of a full gait cycle (two steps); default 0.75 of the stature, that of a
            brisk walk. Slow walkers take shorter strides.
        path: at least one waypoint in order of time; between them the walk is a monotone cubic
            (PCHIP), before the first and after the last the worker stands.
        heading: the way the body faces; empty means along the walk.
        gaze: where the head points; empty means ahead.
    """

    error: ClassVar[type[ValueError]] = SimError

    stature_m: float = Field(default=1.75, ge=1.4, le=2.1)
    stride_m: float | None = Field(default=None, gt=0.2, le=2.5)
    path: tuple[Waypoint, ...] = Field(min_length=1)
    heading: tuple[HeadingKey, ...] = ()
    gaze: tuple[GazeKey, ...] = ()

    @model_validator(mode="after")
    def _in_order_of_time(self) -> WorkerScript:
        for name in ("path", "heading", "gaze"):
            times = [key.t_s for key in getattr(self, name)]
            if any(later <= earlier for earlier, later in itertools.pairwise(times)):
                raise ValueError(f"{name} must have increasing t_s, got {times}")
        return self

    def motion(self, t_s: float) -> WorkerMotion:
        """Where the body is at ``t_s`` and how it moves."""
        start, step, table = _walk_table(self.path)
        place = min(max((t_s - start) / step, 0.0), len(table) - 1.0)
        row = min(int(place), len(table) - 2)
        here = table[row] + (place - row) * (table[row + 1] - table[row])
        moving = 0.0 < place < len(table) - 1.0
        heading = float(here[4])
        if self.heading:
            times = [key.t_s for key in self.heading]
            heading = math.radians(
                float(np.interp(t_s, times, [key.heading_deg for key in self.heading]))
            )
        velocity = here[2:4] if moving else np.zeros(2)
        return WorkerMotion(here[:2], velocity, heading, float(here[5]))

    def gaze_angles(
        self, t_s: float, heading_odom_rad: float, to_robot: tuple[float, float]
    ) -> tuple[float, float]:
        """Azimuth in odom and elevation of the gaze at ``t_s``, radians.

        Args:
            t_s: time.
            heading_odom_rad: the way the body faces now.
            to_robot: azimuth and elevation from the eyes to the robot's camera, radians.
        """
        if not self.gaze:
            return heading_odom_rad, 0.0
        times = [key.t_s for key in self.gaze]
        after = int(np.searchsorted(times, t_s, side="right"))
        first = self.gaze[max(after - 1, 0)]
        second = self.gaze[min(after, len(self.gaze) - 1)]
        azimuth, elevation = _key_angles(first, heading_odom_rad, to_robot)
        if first is second:
            return azimuth, elevation
        share = min(max((t_s - first.t_s) / (second.t_s - first.t_s), 0.0), 1.0)
        share = share * share * (3.0 - 2.0 * share)
        next_azimuth, next_elevation = _key_angles(second, heading_odom_rad, to_robot)
        # Heads turn through the front: blend relative to the body, not the short way round.
        here, there = (_wrapped(angle - heading_odom_rad) for angle in (azimuth, next_azimuth))
        return (
            heading_odom_rad + here + share * (there - here),
            elevation + share * (next_elevation - elevation),
        )


@lru_cache(maxsize=64)
def _walk_table(path: tuple[Waypoint, ...]) -> tuple[float, float, FloatArray]:
    """Start, time step and (N ≥ 2, 6) rows of x, y, vx, vy, heading along the walk, walked."""
    start, end = path[0].t_s, path[-1].t_s
    corners = np.array([[p.x_m, p.y_m] for p in path])
    if len(path) == 1:
        points, velocity, step = np.repeat(corners, 2, axis=0), np.zeros((2, 2)), 1.0
    else:
        count = max(math.ceil((end - start) / _TABLE_STEP_S), 1) + 1
        times = np.linspace(start, end, count)
        spline = PchipInterpolator([p.t_s for p in path], corners)
        points, velocity = spline(times), spline.derivative()(times)
        step = (end - start) / (count - 1)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    walked = np.concatenate([[0.0], np.cumsum(lengths)])
    table = np.column_stack([points, velocity, _heading_along(velocity), walked])
    table.setflags(write=False)
    return start, step, table


def _heading_along(velocity: FloatArray) -> FloatArray:
    """Unwrapped direction of walking, held where the worker hardly moves."""
    moving = np.flatnonzero(np.linalg.norm(velocity, axis=1) > _TURNING_SPEED_MPS)
    if not len(moving):
        return np.zeros(len(velocity))
    place = np.searchsorted(moving, np.arange(len(velocity)))
    nearest = moving[np.clip(place, 0, len(moving) - 1)]
    return np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0])[nearest])


def _wrapped(angle_rad: float) -> float:
    return math.remainder(angle_rad, 2.0 * math.pi)


def _key_angles(
    key: GazeKey, heading_odom_rad: float, to_robot: tuple[float, float]
) -> tuple[float, float]:
    azimuth, elevation = to_robot if key.look == "robot" else (heading_odom_rad, 0.0)
    return azimuth + math.radians(key.yaw_deg), elevation + math.radians(key.pitch_deg)
