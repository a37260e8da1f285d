"""What goes on around a person at one instant."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Mover:
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
    others: tuple[Mover, ...]
    sees_robot: Callable[[], bool]


def _never() -> bool:
    return False


#: Nobody there.
ALONE = Surroundings(None, (), _never)
