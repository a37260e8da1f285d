"""What a scripted worker does: walk, face, look, carry; by keys in time."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import uniform_filter1d

from perception.arrays import FloatArray
from tracking.config import StrictConfig

from ...world.errors import SimError
from ..body import (
    MAX_STATURE_M,
    MIN_STATURE_M,
    Activity,
    ActivityName,
    Footing,
    Gait,
    footstep_table,
    skeleton,
    worker_names,
)

# Below this speed the direction of walking is noise and the body keeps its heading.
_TURNING_SPEED_MPS = 0.05
_TABLE_STEP_S = 0.01
# Bodies turn no more abruptly than this, and hands go from one activity to the next in this time.
_TURN_SMOOTHING_S = 0.4
_CHANGE_S = 0.6
# Feet begin before the body moves and end after it.
_MARGIN_S = 1.5
_IDLE = Activity()


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
    away from that to the left, ``pitch_deg`` up. The eyes turn in the head by ``eye_yaw_deg`` and
    ``eye_pitch_deg``. From one key to the next head and eyes turn smoothly.
    """

    error: ClassVar[type[ValueError]] = SimError

    t_s: float
    look: Literal["ahead", "robot"] = "ahead"
    yaw_deg: float = 0.0
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0)
    eye_yaw_deg: float = Field(default=0.0, ge=-35.0, le=35.0)
    eye_pitch_deg: float = Field(default=0.0, ge=-25.0, le=25.0)


class ActivityKey(StrictConfig):
    """What the hands do from a time on; they take 0.6 s to get there."""

    error: ClassVar[type[ValueError]] = SimError

    t_s: float
    activity: ActivityName


@dataclass(frozen=True, slots=True)
class WorkerMotion:
    """The scripted body at one instant.

    Attributes:
        position_odom_m: (2,).
        velocity_odom_mps: (2,).
        heading_odom_rad: the way the body faces.
        walked_m: length of the path so far.
        feet: where feet and hips are, in odom.
    """

    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    heading_odom_rad: float
    walked_m: float
    feet: Footing


class WorkerScript(StrictConfig):
    """A worker's looks, walk, gaze and activities.

    Attributes:
        stature_m: body height.
        look: name of a shipped worker, scaled to the stature; default the one of nearest stature.
        stride_m: distance of a full gait cycle (two steps); default follows the speed.
        path: at least one waypoint in order of time; between them the walk is a monotone cubic
            (PCHIP), before the first and after the last the worker stands.
        heading: the way the body faces, a monotone cubic between keys; empty means along the walk.
        gaze: where the head points; empty means ahead.
        activities: what the hands do, in order of time and 0.6 s apart at least; the first one
            holds before its time as well. Empty means nothing.
    """

    error: ClassVar[type[ValueError]] = SimError

    stature_m: float = Field(default=1.75, ge=MIN_STATURE_M, le=MAX_STATURE_M)
    look: str | None = None
    stride_m: float | None = Field(default=None, gt=0.2, le=2.5)
    path: tuple[Waypoint, ...] = Field(min_length=1)
    heading: tuple[HeadingKey, ...] = ()
    gaze: tuple[GazeKey, ...] = ()
    activities: tuple[ActivityKey, ...] = ()

    @model_validator(mode="after")
    def _in_order_of_time(self) -> WorkerScript:
        for name, least in (
            ("path", 0.0),
            ("heading", 0.0),
            ("gaze", 0.0),
            ("activities", _CHANGE_S),
        ):
            times = [key.t_s for key in getattr(self, name)]
            if any(
                later <= earlier or later - earlier < least - 1e-9
                for earlier, later in itertools.pairwise(times)
            ):
                apart = f" at least {least} s apart" if least else ""
                raise ValueError(f"{name} must have increasing t_s{apart}, got {times}")
        return self

    @model_validator(mode="after")
    def _known_look(self) -> WorkerScript:
        if self.look is not None and self.look not in worker_names():
            raise ValueError(f"look must be one of {', '.join(worker_names())}, got {self.look!r}")
        return self

    def walk(self) -> WorkerWalk:
        """The walk worked out; scripts that walk alike share it."""
        return _walk(self.path, self.heading, self.look, self.stature_m, self.stride_m)

    def motion(self, t_s: float) -> WorkerMotion:
        """Where the body is at ``t_s``, how it moves and where its feet are."""
        return self.walk().motion(t_s)

    def activity(self, t_s: float) -> Activity:
        """What the hands do at ``t_s``."""
        keys = self.activities
        if not keys:
            return _IDLE
        at = max(sum(key.t_s <= t_s for key in keys) - 1, 0)
        share = min(max((t_s - keys[at].t_s) / _CHANGE_S, 0.0), 1.0)
        before = keys[max(at - 1, 0)].activity
        return Activity(keys[at].activity, before, share * share * (3.0 - 2.0 * share))

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
        first, second, share = self._gaze_keys(t_s)
        azimuth, elevation = _key_angles(first, heading_odom_rad, to_robot)
        if first is second:
            return azimuth, elevation
        next_azimuth, next_elevation = _key_angles(second, heading_odom_rad, to_robot)
        # Heads turn through the front: blend relative to the body, not the short way round.
        here, there = (_wrapped(angle - heading_odom_rad) for angle in (azimuth, next_azimuth))
        return (
            heading_odom_rad + here + share * (there - here),
            elevation + share * (next_elevation - elevation),
        )

    def eye_angles(self, t_s: float) -> tuple[float, float]:
        """Yaw to the left and pitch up of the eyes in the head at ``t_s``, radians."""
        if not self.gaze:
            return 0.0, 0.0
        first, second, share = self._gaze_keys(t_s)
        yaw, pitch = (
            math.radians(before + share * (after - before))
            for before, after in (
                (first.eye_yaw_deg, second.eye_yaw_deg),
                (first.eye_pitch_deg, second.eye_pitch_deg),
            )
        )
        return yaw, pitch

    def _gaze_keys(self, t_s: float) -> tuple[GazeKey, GazeKey, float]:
        """The keys before and after a time, and how far it is from one to the other, eased."""
        after = sum(key.t_s <= t_s for key in self.gaze)
        first = self.gaze[max(after - 1, 0)]
        second = self.gaze[min(after, len(self.gaze) - 1)]
        if first is second:
            return first, second, 0.0
        share = min(max((t_s - first.t_s) / (second.t_s - first.t_s), 0.0), 1.0)
        return first, second, share * share * (3.0 - 2.0 * share)


class WorkerWalk:
    """A scripted walk worked out: rows of a table over time.

    Args:
        path: at least one waypoint.
        heading: keys of the way the body faces, maybe none.
        gait: of the body.
    """

    def __init__(
        self, path: tuple[Waypoint, ...], heading: tuple[HeadingKey, ...], gait: Gait
    ) -> None:
        first, last = path[0].t_s, path[-1].t_s
        steps = max(math.ceil((last - first) / _TABLE_STEP_S), 1)
        # Rows fall on the first and the last waypoint.
        step = (last - first) / steps if last > first else _TABLE_STEP_S
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
        feet = footstep_table(gait, times, points, facing, velocity)
        self._rows = np.column_stack([points, velocity, facing, walked, feet])
        self._start_s, self._step_s = float(times[0]), step
        self._walking_s = (first, last) if len(path) > 1 else (math.inf, -math.inf)

    def motion(self, t_s: float) -> WorkerMotion:
        """Where the body is at ``t_s``, how it moves and where its feet are."""
        rows = self._rows
        place = min(max((t_s - self._start_s) / self._step_s, 0.0), len(rows) - 1.0)
        row = min(int(place), len(rows) - 2)
        here: FloatArray = rows[row] + (place - row) * (rows[row + 1] - rows[row])
        heading, walked, *feet = here[4:].tolist()
        walking = self._walking_s[0] <= t_s <= self._walking_s[1]
        return WorkerMotion(
            position_odom_m=here[:2],
            velocity_odom_mps=here[2:4] if walking else np.zeros(2),
            heading_odom_rad=heading,
            walked_m=walked,
            feet=Footing.of_row(feet),
        )


@lru_cache(maxsize=64)
def _walk(
    path: tuple[Waypoint, ...],
    heading: tuple[HeadingKey, ...],
    look: str | None,
    stature_m: float,
    stride_m: float | None,
) -> WorkerWalk:
    return WorkerWalk(path, heading, Gait(skeleton(look, stature_m), stride_m))


def _facing(
    heading: tuple[HeadingKey, ...], times: FloatArray, velocity: FloatArray, step_s: float
) -> FloatArray:
    """Unwrapped heading at every time: by its keys, else along the walk."""
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
