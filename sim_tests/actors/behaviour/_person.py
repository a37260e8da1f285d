"""What goes on around a person at one instant.

A person of a crossing at one instant, whoever decides what the person does.

What became of one person in one episode.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from perception.arrays import FloatArray

from ..body import Activity, Footing


@dataclass(frozen=True, slots=True)
class MovingBody:
    """Somebody else's place and velocity, in odom."""

    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float


@dataclass(frozen=True, slots=True)
class RobotBody:
    """The robot as one can see it: a rectangle that moves, and a camera on top; in odom.

    Attributes:
        x_m: of the base.
        y_m: of the base.
        heading_rad: of the base.
        vx_mps: velocity.
        vy_mps: velocity.
        half_length_m: of the rectangle, along the heading.
        half_width_m: across.
        camera_m: (x, y, z) of the camera.
    """

    x_m: float
    y_m: float
    heading_rad: float
    vx_mps: float
    vy_mps: float
    half_length_m: float
    half_width_m: float
    camera_m: tuple[float, float, float]

    def nearest_m(self, x_m: float, y_m: float) -> tuple[float, float]:
        """The point of the rectangle that is nearest to (x, y)."""
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        dx, dy = x_m - self.x_m, y_m - self.y_m
        ahead = min(max(cos * dx + sin * dy, -self.half_length_m), self.half_length_m)
        aside = min(max(cos * dy - sin * dx, -self.half_width_m), self.half_width_m)
        return self.x_m + cos * ahead - sin * aside, self.y_m + sin * ahead + cos * aside

    def later(self, after_s: float) -> RobotBody:
        """The same, gone on as it went for a while."""
        dx, dy = self.vx_mps * after_s, self.vy_mps * after_s
        x, y, z = self.camera_m
        return RobotBody(
            self.x_m + dx,
            self.y_m + dy,
            self.heading_rad,
            self.vx_mps,
            self.vy_mps,
            self.half_length_m,
            self.half_width_m,
            (x + dx, y + dy, z),
        )


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What is around one person.

    Attributes:
        robot: None in a hall without.
        others: everybody else.
        sees_robot: whether nothing stands between the person's eyes and the robot's camera; asked
            only when the robot is where the person could see it.
    """

    robot: RobotBody | None
    others: tuple[MovingBody, ...]
    sees_robot: Callable[[], bool]


def _never() -> bool:
    return False


#: Nobody there.
ALONE = Surroundings(None, (), _never)


@dataclass(frozen=True, slots=True, eq=False)
class PersonMotion:
    """A person at one instant; angles in radians.

    Attributes:
        position_odom_m: (2,) of the body's centre line.
        velocity_odom_mps: (2,).
        heading_odom_rad: the way the body faces.
        walked_m: length of the way so far.
        feet: where feet and hips are, in odom.
        head_yaw_rad: of the head from the body, left positive.
        head_pitch_rad: up positive.
        eye_yaw_rad: of the eyes in the head.
        eye_pitch_rad: of the eyes in the head.
        activity: what the hands do.
    """

    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    heading_odom_rad: float
    walked_m: float
    feet: Footing
    head_yaw_rad: float
    head_pitch_rad: float
    eye_yaw_rad: float
    eye_pitch_rad: float
    activity: Activity


class PersonBehaviour(Protocol):
    """Decides what one person of a crossing does: a script, a recording or a mind of its own."""

    @property
    def stature_m(self) -> float:
        """Height of the body."""
        ...

    @property
    def look(self) -> str | None:
        """Name of a shipped worker; None is the one of the nearest stature."""
        ...

    @property
    def stride_m(self) -> float | None:
        """Distance of a full gait cycle; None follows the speed."""
        ...

    def motion(self, t_s: float, around: Surroundings) -> PersonMotion:
        """What the person does at ``t_s``; time never goes back."""
        ...

    def hold(self) -> None:
        """The last motion would have led into the robot: the body stays where it was before."""
        ...

    def touch(self, towards_x: float, towards_y: float) -> None:
        """Body and robot touch; the robot lies in this direction (a unit vector in odom)."""
        ...


@dataclass(frozen=True, slots=True)
class PersonOutcome:
    """What became of one person in one episode.

    Attributes:
        name: of the person in the scenario.
        noticed_s: when the person first looked at the robot; None if never.
        reaction: what a person who had seen the robot did: ``"walk_on"``, ``"wait"``, ``"hurry"``,
            ``"pass_behind"`` or ``"claim"``; empty for one who never had to choose.
        time_s: from setting out to the end of the route; None if it was not reached.
        free_time_s: the same without robot and other people, pauses included; None for a person
            without a route to an end.
        length_m: walked.
        free_length_m: of the route; None as ``free_time_s``.
    """

    name: str
    noticed_s: float | None = None
    reaction: str = ""
    time_s: float | None = None
    free_time_s: float | None = None
    length_m: float = 0.0
    free_length_m: float | None = None
