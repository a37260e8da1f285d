"""The motion of a rigid body in the plane: the one description of it that all rooms share."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, NamedTuple

from ._robot import RobotState

# Places on an arc are given so many times while a body moves.
_PLACES: Final = 24
# Of a smaller turn, the bulge of an arc is rounding, and its radius may be infinite.
_STRAIGHT_RAD: Final = 1e-12


class Motion(NamedTuple):
    """A rigid body that keeps its velocity, in odom, as plain floats.

    The velocity turns with the body, so that a body with a yaw rate drives an arc. People have no
    yaw rate. Each point of the body has a velocity of its own, v + ω × r.

    Attributes:
        x_m: place of the base.
        y_m: the same.
        heading_rad: counter-clockwise from the x axis.
        forward_mps: velocity along the heading.
        left_mps: velocity to the left of it.
        yaw_rate_radps: counter-clockwise positive.
    """

    x_m: float
    y_m: float
    heading_rad: float = 0.0
    forward_mps: float = 0.0
    left_mps: float = 0.0
    yaw_rate_radps: float = 0.0

    @classmethod
    def of(cls, state: RobotState) -> Motion:
        """Return the motion of a robot."""
        x_m, y_m = state.position_odom_m.tolist()
        return cls(
            *(x_m, y_m, state.heading_odom_rad),
            *(state.speed_mps, state.lateral_mps, state.yaw_rate_radps),
        )

    @property
    def velocity_mps(self) -> tuple[float, float]:
        """The velocity of the base in odom."""
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return (
            self.forward_mps * cos - self.left_mps * sin,
            self.forward_mps * sin + self.left_mps * cos,
        )

    @property
    def travel_mps(self) -> float:
        """Speed of the base, ≥ 0."""
        return math.hypot(self.forward_mps, self.left_mps)

    def velocity_at(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the velocity in odom of the point of the body that is at a place in odom."""
        vx, vy = self.velocity_mps
        rate = self.yaw_rate_radps
        return vx - rate * (y_m - self.y_m), vy + rate * (x_m - self.x_m)

    def fastest_mps(self, radius_m: float) -> float:
        """Return an upper bound of the speed of all points within a radius of the base."""
        return self.travel_mps + abs(self.yaw_rate_radps) * radius_m

    def point(self, ahead_m: float, left_m: float) -> tuple[float, float]:
        """Return the place in odom of a point of the body, given from its base."""
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return (
            self.x_m + cos * ahead_m - sin * left_m,
            self.y_m + sin * ahead_m + cos * left_m,
        )

    def at(self, after_s: float) -> Motion:
        """Return the motion after a time, which may be negative: the arc is exact."""
        half_rad = 0.5 * self.yaw_rate_radps * after_s
        # The chord of an arc is shorter than the arc, and turned by half of its angle.
        chord_s = after_s * (math.sin(half_rad) / half_rad if half_rad else 1.0)
        middle = self._replace(heading_rad=self.heading_rad + half_rad)
        x_m, y_m = middle.point(chord_s * self.forward_mps, chord_s * self.left_mps)
        return self._replace(x_m=x_m, y_m=y_m, heading_rad=self.heading_rad + 2.0 * half_rad)

    def stopping_s(self, reaction_s: float, deceleration_mps2: float, radius_m: float) -> float:
        """Return the time in which a body at this velocity moves as far as until it has braked.

        It brakes after the reaction time and keeps its curve. One that turns on the spot brakes the
        points at a radius as it would brake its base.
        """
        fastest_mps = max(self.travel_mps, abs(self.yaw_rate_radps) * radius_m)
        return reaction_s + 0.5 * fastest_mps / deceleration_mps2

    def swept(
        self, points_m: Iterable[tuple[float, float]], until_s: float
    ) -> tuple[list[tuple[float, float]], float]:
        """Return places that points of the body pass until a time, and how far apart they bulge.

        The points are given from the base. Between two of the places a point is no farther from the
        straight line than by the second number, in metres.
        """
        points = list(points_m)
        count = _PLACES if abs(self.yaw_rate_radps) * until_s > _STRAIGHT_RAD else 1
        motions = [self.at(until_s * index / count) for index in range(count + 1)]
        places = [motion.point(*point) for motion in motions for point in points]
        if count == 1:
            return places, 0.0
        radius_m = max(math.hypot(*point) for point in points)
        radius_m += self.travel_mps / abs(self.yaw_rate_radps)
        step_rad = self.yaw_rate_radps * until_s / count
        return places, radius_m * (1.0 - math.cos(0.5 * min(abs(step_rad), math.pi)))
