"""The face of a person in a crossing: surroundings in, motion out, and the outcome at the end."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from nav_adapter.rigid import Motion
from perception.arrays import FloatArray

from ..body import KNEELING_EYE_HEIGHT_SHARE, SEATED_EYE_HEIGHT_SHARE, Activity, GaitPose
from ._hearing import Heard

# People who are away are this far from their place.
_AWAY_M: Final = 1000.0
#: Height of the eyes as a share of stature.
EYE_HEIGHT_SHARE: Final = 0.94
#: A slower robot counts as standing.
ROBOT_STANDING_MPS: Final = 0.08
_LOW_EYE_HEIGHT_SHARES: Final = {
    "sitting": SEATED_EYE_HEIGHT_SHARE,
    "kneeling": KNEELING_EYE_HEIGHT_SHARE,
}


def eye_height_m(stature_m: float, activity: str = "none") -> float:
    """Return the height of the eyes of a person who stands, sits or kneels."""
    return _LOW_EYE_HEIGHT_SHARES.get(activity, EYE_HEIGHT_SHARE) * stature_m


@dataclass(frozen=True, slots=True)
class MovingBody:
    """Position and velocity of another person in odom."""

    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float


@dataclass(frozen=True, slots=True)
class RobotBody:
    """The robot as a person can see it, in odom: a moving rectangle with a camera.

    Attributes:
        x_m: position of the rectangle's middle.
        y_m: the same.
        heading_rad: heading of the base.
        vx_mps: velocity of the middle.
        vy_mps: the same.
        half_length_m: half the rectangle's length along the heading.
        half_width_m: half its width.
        camera_m: (x, y, z) of the camera.
        yaw_rate_radps: counter-clockwise positive.
    """

    x_m: float
    y_m: float
    heading_rad: float
    vx_mps: float
    vy_mps: float
    half_length_m: float
    half_width_m: float
    camera_m: tuple[float, float, float]
    yaw_rate_radps: float = 0.0

    def nearest_point_m(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the point of the rectangle nearest to (x, y)."""
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        dx, dy = x_m - self.x_m, y_m - self.y_m
        ahead = min(max(cos * dx + sin * dy, -self.half_length_m), self.half_length_m)
        aside = min(max(cos * dy - sin * dx, -self.half_width_m), self.half_width_m)
        return self.x_m + cos * ahead - sin * aside, self.y_m + sin * ahead + cos * aside

    def gap_to_line_m(self, point_m: tuple[float, float], direction: tuple[float, float]) -> float:
        """Return the distance of the rectangle from a line through a point; 0 where it is on it."""
        (x, y), (ux, uy) = point_m, direction
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        half_m = self.half_length_m * abs(ux * sin - uy * cos)
        half_m += self.half_width_m * abs(ux * cos + uy * sin)
        return max(abs(ux * (self.y_m - y) - uy * (self.x_m - x)) - half_m, 0.0)

    @property
    def course(self) -> Motion:
        """The robot as it goes on, heading where it drives; that of its body while it stands."""
        speed_mps = math.hypot(self.vx_mps, self.vy_mps)
        if speed_mps <= ROBOT_STANDING_MPS:
            return Motion(self.x_m, self.y_m, self.heading_rad)
        along_rad = math.atan2(self.vy_mps, self.vx_mps)
        return Motion(self.x_m, self.y_m, along_rad, speed_mps, 0.0, self.yaw_rate_radps)

    def extrapolated(self, dt_s: float) -> RobotBody:
        """Return the robot after ``dt_s`` on its present curve."""
        motion = Motion(self.x_m, self.y_m, 0.0, self.vx_mps, self.vy_mps, self.yaw_rate_radps)
        later = motion.at(dt_s)
        x, y, z = self.camera_m
        camera = later.point(x - self.x_m, y - self.y_m)
        return RobotBody(
            later.x_m,
            later.y_m,
            self.heading_rad + later.heading_rad,
            *later.velocity_mps,
            self.half_length_m,
            self.half_width_m,
            (*camera, z),
            self.yaw_rate_radps,
        )


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The surroundings of one person at one instant, and what happened to them since the last one.

    Attributes:
        robot: the robot; None without one.
        others: all other people.
        sees_robot: whether the line from the person's eyes to the robot's camera is free. It is
            called only while the robot is in the person's field of view.
        held: the last motion would have led into the robot, and the body stayed.
        heard: answers to requests for attention that the person has heard.
        touches: contacts with the robot: its direction from the person each time, a unit vector in
            odom.
    """

    robot: RobotBody | None
    others: tuple[MovingBody, ...]
    sees_robot: Callable[[], bool]
    held: bool = False
    heard: tuple[Heard, ...] = ()
    touches: tuple[tuple[float, float], ...] = ()


def _never() -> bool:
    return False


#: Surroundings without a robot and without other people.
ALONE: Final = Surroundings(None, (), _never)


@dataclass(frozen=True, slots=True, eq=False)
class PersonMotion:
    """A person at one instant.

    Attributes:
        position_odom_m: (2,) position of the body's centre line.
        velocity_odom_mps: (2,).
        heading_odom_rad: heading of the body.
        walked_m: length of the path so far.
        feet: gait pose in odom.
        head_yaw_rad: of the head from the body, left positive.
        head_pitch_rad: of the head, up positive.
        eye_yaw_rad: of the eyes from the head, left positive.
        eye_pitch_rad: of the eyes from the head, up positive.
        activity: of the hands, or sitting or kneeling.
        away: the person is not there, and placed far outside of the hall.
    """

    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    heading_odom_rad: float
    walked_m: float
    feet: GaitPose
    head_yaw_rad: float
    head_pitch_rad: float
    eye_yaw_rad: float
    eye_pitch_rad: float
    activity: Activity
    away: bool = False

    def far_away(self) -> PersonMotion:
        """Return the motion of a person who is not there: out of every sensor's range."""
        place = self.position_odom_m + np.array([_AWAY_M, 0.0])
        feet = self.feet.moved(_AWAY_M, 0.0)
        return replace(self, position_odom_m=place, feet=feet, away=True)


@dataclass(frozen=True, slots=True)
class PersonOutcome:
    """The outcome of one episode for one person.

    Attributes:
        name: of the person in the scenario.
        noticed_s: time of the first look that took the robot in; None without one.
        reaction: first reaction to the robot: ``"walk_on"``, ``"wait"``, ``"hurry"``,
            ``"pass_behind"`` or ``"claim"``; empty without an encounter.
        time_s: from the start to the end of the route; None if the end was not reached.
        free_time_s: the same for the same people with the same seed, the robot absent; None where
            that walk has no route or did not end by now.
        length_m: length of the path walked.
        free_length_m: the same without the robot; None as ``free_time_s``.
        late_s: of somebody on the way: how much longer than without the robot they took to come so
            far, or more. None before the start, at the end of the route, and without one.
    """

    name: str
    noticed_s: float | None = None
    reaction: str = ""
    time_s: float | None = None
    free_time_s: float | None = None
    length_m: float = 0.0
    free_length_m: float | None = None
    late_s: float | None = None

    @property
    def delay_s(self) -> float | None:
        """Delay by the robot, so far for somebody on the way; None where it is not known."""
        if self.time_s is None or self.free_time_s is None:
            return self.late_s
        return self.time_s - self.free_time_s
