"""Scripted workers: walk, heading, gaze and activities by keys in time."""

from __future__ import annotations

import itertools
import math
from typing import Final, Literal

from pydantic import Field, model_validator

from ...world.config import SimConfig
from ..body import (
    MAX_HEAD_PITCH_RAD,
    MAX_HEAD_YAW_RAD,
    MAX_STATURE_M,
    MIN_STATURE_M,
    STAYING,
    Activity,
    ActivityName,
    worker_names,
)
from ._hearing import Hearing
from ._person import PersonMotion, Surroundings, eye_height_m
from ._planned_walk import HeadingKey, PlannedMotion, PlannedWalk, Waypoint, planned_walk

# Hands change from one activity to the next in this time.
_CHANGE_S: Final = 0.6
_IDLE: Final = Activity()


class GazeKey(SimConfig):
    """Direction of head and eyes at a time.

    ``look: ahead`` is the heading of the body, ``look: robot`` the direction to the robot's camera.
    The head points ``yaw_deg`` to the left of it and ``pitch_deg`` above it. The eyes turn in the
    head by ``eye_yaw_deg`` and ``eye_pitch_deg``. Head and eyes turn smoothly between two keys.

    Attributes:
        t_s: time from the start of the episode.
        look: direction that the angles are counted from.
        yaw_deg: yaw of the head, left positive.
        pitch_deg: pitch of the head, up positive.
        eye_yaw_deg: yaw of the eyes in the head, left positive.
        eye_pitch_deg: pitch of the eyes in the head, up positive.
    """

    t_s: float
    look: Literal["ahead", "robot"] = "ahead"
    yaw_deg: float = 0.0
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0)
    eye_yaw_deg: float = Field(default=0.0, ge=-35.0, le=35.0)
    eye_pitch_deg: float = Field(default=0.0, ge=-25.0, le=25.0)


class ActivityKey(SimConfig):
    """Activity of the hands from a time on; the change takes 0.6 s. Or sitting or kneeling.

    Attributes:
        t_s: time from the start of the episode.
        activity: the activity.
    """

    t_s: float
    activity: ActivityName


class WorkerScript(SimConfig):
    """The script of a worker.

    Attributes:
        stature_m: body height.
        look: name of a shipped worker, scaled to the stature; default the one of nearest stature.
        stride_m: distance of a full gait cycle (two steps); default follows the speed.
        path: at least one waypoint in order of time. The walk is a monotone cubic (PCHIP) between
            them; the worker stands before the first and after the last one.
        heading: keys of the body's heading, with a monotone cubic between them; empty faces along
            the walk.
        gaze: keys of head and eyes; empty looks ahead.
        activities: keys of the hands in order of time, at least 0.6 s apart. The first one holds
            before its time as well. Empty is none. ``sitting`` and ``kneeling`` are postures of the
            whole body for the whole script, of a worker who stays at one place with one heading.
        hearing: how the worker hears a request for attention; None as the scenario says.
    """

    stature_m: float = Field(default=1.75, ge=MIN_STATURE_M, le=MAX_STATURE_M)
    look: str | None = None
    stride_m: float | None = Field(default=None, gt=0.2, le=2.5)
    path: tuple[Waypoint, ...] = Field(min_length=1)
    heading: tuple[HeadingKey, ...] = ()
    gaze: tuple[GazeKey, ...] = ()
    activities: tuple[ActivityKey, ...] = ()
    hearing: Hearing | None = None

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

    @model_validator(mode="after")
    def _low_people_stay(self) -> WorkerScript:
        names = {key.activity for key in self.activities}
        low = next((name for name in STAYING if name in names), None)
        if low is None:
            return self
        if len(names) > 1:
            raise ValueError(
                f"a worker who sits or kneels stays there: activities must all be {low!r}, got "
                f"{', '.join(sorted(names))}"
            )
        if len({(point.x_m, point.y_m) for point in self.path}) > 1 or len(self.heading) > 1:
            raise ValueError(
                "a worker who sits or kneels stays at one place with one heading, got "
                f"{len(self.path)} waypoints of path and {len(self.heading)} keys of heading"
            )
        return self

    @property
    def stays(self) -> bool:
        """True if the worker sits or kneels."""
        return bool(self.activities) and self.activities[0].activity in STAYING

    def walk(self) -> PlannedWalk:
        """Return the planned walk."""
        return planned_walk(self.path, self.heading, self.look, self.stature_m, self.stride_m)

    def motion(self, t_s: float) -> PlannedMotion:
        """Return the body's motion at ``t_s``."""
        return self.walk().motion(t_s)

    def activity(self, t_s: float) -> Activity:
        """Return the activity of the hands at ``t_s``."""
        keys = self.activities
        if not keys:
            return _IDLE
        row = max(sum(key.t_s <= t_s for key in keys) - 1, 0)
        share = min(max((t_s - keys[row].t_s) / _CHANGE_S, 0.0), 1.0)
        before = keys[max(row - 1, 0)].activity
        return Activity(keys[row].activity, before, _smoothstep(share))

    def gaze_angles(
        self, t_s: float, heading_odom_rad: float, to_robot: tuple[float, float]
    ) -> tuple[float, float]:
        """Return azimuth in odom and elevation of the head at ``t_s``, radians.

        Args:
            t_s: time.
            heading_odom_rad: heading of the body now.
            to_robot: azimuth and elevation from the eyes to the robot's camera, radians.
        """
        if not self.gaze:
            return heading_odom_rad, 0.0
        first, second, share = self._gaze_keys(t_s)
        azimuth, elevation = _key_angles(first, heading_odom_rad, to_robot)
        if first is second:
            return azimuth, elevation
        next_azimuth, next_elevation = _key_angles(second, heading_odom_rad, to_robot)
        # A head turns through the front: interpolate relative to the body, not the short way.
        here, there = (
            math.remainder(angle - heading_odom_rad, math.tau) for angle in (azimuth, next_azimuth)
        )
        return (
            heading_odom_rad + here + share * (there - here),
            elevation + share * (next_elevation - elevation),
        )

    def eye_angles(self, t_s: float) -> tuple[float, float]:
        """Return yaw to the left and pitch up of the eyes in the head at ``t_s``, radians."""
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
        """Return the keys before and after a time, and the smooth progress between them."""
        after = sum(key.t_s <= t_s for key in self.gaze)
        first = self.gaze[max(after - 1, 0)]
        second = self.gaze[min(after, len(self.gaze) - 1)]
        if first is second:
            return first, second, 0.0
        share = min(max((t_s - first.t_s) / (second.t_s - first.t_s), 0.0), 1.0)
        return first, second, _smoothstep(share)


class Scripted:
    """A person who follows a script regardless of the surroundings.

    Args:
        script: the script.
        offset_s: delay of the whole script.
    """

    def __init__(self, script: WorkerScript, offset_s: float) -> None:
        self.script = script
        self._walk = script.walk()
        self._offset_s = offset_s

    @property
    def stature_m(self) -> float:
        """Height of the body."""
        return self.script.stature_m

    @property
    def look(self) -> str | None:
        """Name of a shipped worker."""
        return self.script.look

    @property
    def stride_m(self) -> float | None:
        """Distance of a full gait cycle."""
        return self.script.stride_m

    def motion(self, t_s: float, around: Surroundings) -> PersonMotion:
        """Return the scripted motion; of the surroundings only the robot's camera matters."""
        t_s -= self._offset_s
        motion = self._walk.motion(t_s)
        heading = motion.heading_odom_rad
        x, y = motion.position_odom_m.tolist()
        to_robot = heading, 0.0
        if around.robot is not None:
            camera_x, camera_y, camera_z = around.robot.camera_m
            up = camera_z - eye_height_m(self.stature_m, self.script.activity(t_s).name)
            to_robot = (
                math.atan2(camera_y - y, camera_x - x),
                math.atan2(up, math.hypot(camera_x - x, camera_y - y)),
            )
        azimuth, elevation = self.script.gaze_angles(t_s, heading, to_robot)
        eye_yaw, eye_pitch = self.script.eye_angles(t_s)
        yaw = math.remainder(azimuth - heading, math.tau)
        return PersonMotion(
            position_odom_m=motion.position_odom_m,
            velocity_odom_mps=motion.velocity_odom_mps,
            heading_odom_rad=heading,
            walked_m=motion.walked_m,
            feet=motion.feet,
            head_yaw_rad=min(max(yaw, -MAX_HEAD_YAW_RAD), MAX_HEAD_YAW_RAD),
            head_pitch_rad=min(max(elevation, -MAX_HEAD_PITCH_RAD), MAX_HEAD_PITCH_RAD),
            eye_yaw_rad=eye_yaw,
            eye_pitch_rad=eye_pitch,
            activity=self.script.activity(t_s),
        )

    def hold(self) -> None:
        """Do nothing: the script continues."""

    def touch(self, towards_x: float, towards_y: float) -> None:
        """Do nothing: the script continues."""


def _key_angles(
    key: GazeKey, heading_odom_rad: float, to_robot: tuple[float, float]
) -> tuple[float, float]:
    """Return azimuth in odom and elevation of the head at a key, radians."""
    azimuth, elevation = to_robot if key.look == "robot" else (heading_odom_rad, 0.0)
    return azimuth + math.radians(key.yaw_deg), elevation + math.radians(key.pitch_deg)


def _smoothstep(share: float) -> float:
    """Rise from 0 at 0 to 1 at 1 with zero slope at both ends."""
    return share * share * (3.0 - 2.0 * share)
