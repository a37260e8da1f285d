"""The robot: its profile and its state."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Final, Literal, get_args

import numpy as np
from shapely.geometry import MultiPoint

from perception.arrays import FloatArray, finite_array, finite_number, set_fields

from ._errors import NavError

# A robot of 5 cm by 4 cm. An outline below that is a line, a point, or in another unit.
_SMALLEST_FOOTPRINT_M2: Final = 0.002
# No corner of a rigid robot is further from its base origin.
_LARGEST_REACH_M: Final = 10.0
# The largest values that robots among people have: (number, unit, what a larger one is often in).
# A tyre on a floor brakes with about 1 g at most.
_LARGEST: Final = {
    "max_speed_mps": (15.0, "m/s", "mm/s, cm/s or km/h"),
    "max_acceleration_mps2": (10.0, "m/s²", "mm/s² or cm/s²"),
    "max_deceleration_mps2": (10.0, "m/s²", "mm/s² or cm/s²"),
    "reaction_time_s": (5.0, "s", "milliseconds"),
    "max_yaw_rate_radps": (20.0, "rad/s", "degrees per second"),
    "max_yaw_acceleration_radps2": (100.0, "rad/s²", "degrees per second squared"),
    "min_turning_radius_m": (100.0, "m", "millimetres or centimetres"),
}
# Wheels slip and filters of odometry err: lateral speed up to this is noise.
LATERAL_NOISE_MPS: Final = 0.1
# The forward speed is given twice with velocity_base_mps.
_SAME_SPEED_MPS: Final = 1e-6

Drive = Literal["differential", "ackermann", "holonomic"]
_OPTIONAL_LIMITS: Final = (
    "max_yaw_rate_radps",
    "max_yaw_acceleration_radps2",
    "min_turning_radius_m",
)


@dataclass(frozen=True, eq=False)
class RobotProfile:
    """The robot's footprint and its limits of motion.

    Attributes:
        footprint_m: (M, 2), M ≥ 3, corners in the base frame (x forward, y left), clockwise or
            counter-clockwise. The convex hull counts: at least 0.002 m², within 10 m of the base
            origin, and not wholly to one side of it.
        max_speed_mps: > 0, up to 15 m/s.
        max_acceleration_mps2: > 0, up to 10 m/s².
        max_deceleration_mps2: > 0, up to 10 m/s², a deceleration that the brakes always reach.
        reaction_time_s: 0 to 5 s, from a change in the scene to the start of braking: exposure,
            perception, the period of the control loop and the delay of the drive.
        drive: ``"differential"`` for a robot that turns on the spot and cannot move sideways,
            ``"ackermann"`` for one that steers (a car, a tricycle), ``"holonomic"`` for one that
            can move sideways, None if it is not known. With the first two the adapter stops a
            robot whose state moves sideways, since one of the two is wrong. The base origin of
            these two lies on the axle that does not steer.
        max_yaw_rate_radps: > 0, up to 20 rad/s, the fastest turn, either way; None if it is not
            known. It limits commands (:mod:`nav_adapter.motion`) and Nav2's message
            (:func:`nav_adapter.ros2.speed_limit`), and changes no limit of the constraints.
        max_yaw_acceleration_radps2: > 0, up to 100 rad/s², the fastest change of the yaw rate; None
            if it is not known.
        min_turning_radius_m: > 0, up to 100 m, the tightest curve of the base origin, needed with
            ``"ackermann"`` and refused with any other drive: |ω| ≤ |v| / radius. It limits
            commands and changes no speed limit.
        brakes_on_curve: True for a robot that keeps to its present curve until it stands, as one
            does that follows a path and slows down on it: no planner turns it towards people beside
            its path meanwhile. The limit then counts its own curve alone, not the courses turned
            off it by up to the policy's ``turn_deg``.

    Raises:
        NavError: for a value out of these bounds, which no robot among people has: the message
            names the unit, and the unit that the value may be in.
    """

    footprint_m: FloatArray
    max_speed_mps: float
    max_acceleration_mps2: float
    max_deceleration_mps2: float
    reaction_time_s: float
    drive: Drive | None = None
    max_yaw_rate_radps: float | None = None
    max_yaw_acceleration_radps2: float | None = None
    min_turning_radius_m: float | None = None
    brakes_on_curve: bool = False

    def __post_init__(self) -> None:
        if self.drive is not None and self.drive not in get_args(Drive):
            raise NavError(
                "drive must be 'differential', 'ackermann', 'holonomic' or None, got "
                f"{self.drive!r:.80}"
            )
        if (self.drive == "ackermann") != (self.min_turning_radius_m is not None):
            raise NavError(
                "min_turning_radius_m must be given with drive='ackermann' and with no other "
                f"drive, got {self.min_turning_radius_m!r:.80} with drive={self.drive!r}"
            )
        if not isinstance(self.brakes_on_curve, bool):
            raise NavError(
                f"brakes_on_curve must be True or False, got {self.brakes_on_curve!r:.80}"
            )
        footprint = finite_array("footprint_m", self.footprint_m, ("M", 2), NavError)
        if len(footprint) < 3:
            raise NavError(f"footprint_m must have at least 3 corners, got {len(footprint)}")
        area = float(MultiPoint(footprint).convex_hull.area)
        if area < _SMALLEST_FOOTPRINT_M2:
            raise NavError(
                f"footprint_m must enclose at least {_SMALLEST_FOOTPRINT_M2:g} m², got {area:g} "
                "m²; its corners are in metres"
            )
        reach_m = float(np.linalg.norm(footprint, axis=1).max())
        if reach_m > _LARGEST_REACH_M:
            raise NavError(
                f"footprint_m must lie within {_LARGEST_REACH_M:g} m of the base origin, got a "
                f"corner at {reach_m:g} m; are the corners in millimetres or centimetres?"
            )
        _refuse_beside_origin(footprint)
        given = [
            name
            for name in _LARGEST
            if name not in _OPTIONAL_LIMITS or getattr(self, name) is not None
        ]
        set_fields(self, footprint_m=footprint, **{name: self._checked(name) for name in given})

    def _checked(self, name: str) -> float:
        """Return a limit of motion that is above 0 and no larger than any robot's."""
        zero_is_valid = name == "reaction_time_s"
        number = finite_number(
            name, getattr(self, name), NavError, minimum=0.0, exclusive_minimum=not zero_is_valid
        )
        largest, unit, other = _LARGEST[name]
        if number > largest:
            raise NavError(
                f"{name} must be at most {largest:g} {unit}, got {number:g} {unit}; is it in "
                f"{other}?"
            )
        return number

    @classmethod
    def of_settings(cls, settings: Any) -> RobotProfile:
        """Return the profile of settings whose attributes have the names of its fields.

        Raises:
            NavError: for a value out of bounds.
        """
        return cls(**{each.name: getattr(settings, each.name) for each in fields(cls)})

    @property
    def moves_sideways(self) -> bool | None:
        """True for a drive that can move sideways; None if it is not known."""
        return None if self.drive is None else self.drive == "holonomic"

    def turn_rad(self, turn_deg: float) -> float:
        """Return by how much it may turn off its curve while it stops, if others turn so far."""
        return 0.0 if self.brakes_on_curve else math.radians(turn_deg)

    @cached_property
    def circumscribed_radius_m(self) -> float:
        """Radius of the circle about the base origin that contains the footprint."""
        return float(np.linalg.norm(self.footprint_m, axis=1).max())

    @cached_property
    def half_width_m(self) -> float:
        """Farthest part of the footprint to either side of the base."""
        return float(np.abs(self.footprint_m[:, 1]).max())


def _refuse_beside_origin(footprint: FloatArray) -> None:
    """Raise NavError for an outline that lies wholly to one side of the base origin."""
    below, above = ("behind", "to the right of"), ("ahead of", "to the left of")
    for axis in (0, 1):
        low, high = footprint[:, axis].min(), footprint[:, axis].max()
        if low > 0.0 or high < 0.0:
            side = above[axis] if low > 0.0 else below[axis]
            raise NavError(
                f"footprint_m must lie around the base origin, got one wholly {side} it, "
                f"{low:g} to {high:g} m; are its corners in the frame of a sensor, or counted from "
                "a corner of the robot?"
            )


@dataclass(frozen=True, slots=True, eq=False)
class RobotState:
    """The robot's pose and velocity.

    Attributes:
        stamp_s: time of the state.
        position_odom_m: (2,).
        heading_odom_rad: counter-clockwise from the x axis of odom.
        speed_mps: signed, forward positive.
        yaw_rate_radps: counter-clockwise positive.
        velocity_base_mps: (2,), forward and left, of a robot that can move sideways. Its first
            number is ``speed_mps``. None for a robot that moves straight ahead.

    Raises:
        NavError: for a number that is not finite, a wrong shape, or a ``velocity_base_mps`` that
            contradicts ``speed_mps``.
    """

    stamp_s: float
    position_odom_m: FloatArray
    heading_odom_rad: float
    speed_mps: float
    yaw_rate_radps: float
    velocity_base_mps: FloatArray | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            position_odom_m=finite_array("position_odom_m", self.position_odom_m, (2,), NavError),
            stamp_s=finite_number("stamp_s", self.stamp_s, NavError),
            heading_odom_rad=finite_number("heading_odom_rad", self.heading_odom_rad, NavError),
            speed_mps=finite_number("speed_mps", self.speed_mps, NavError),
            yaw_rate_radps=finite_number("yaw_rate_radps", self.yaw_rate_radps, NavError),
        )
        if self.velocity_base_mps is None:
            return
        velocity = finite_array("velocity_base_mps", self.velocity_base_mps, (2,), NavError)
        if abs(velocity[0] - self.speed_mps) > _SAME_SPEED_MPS * max(1.0, abs(self.speed_mps)):
            raise NavError(
                "speed_mps must be the first number of velocity_base_mps, got "
                f"{self.speed_mps:g} m/s and {velocity[0]:g} m/s"
            )
        set_fields(self, velocity_base_mps=velocity)

    @property
    def lateral_mps(self) -> float:
        """Speed to the left."""
        return 0.0 if self.velocity_base_mps is None else float(self.velocity_base_mps[1])

    @property
    def travel_mps(self) -> float:
        """Speed along the direction of travel, ≥ 0."""
        return math.hypot(self.speed_mps, self.lateral_mps)

    @property
    def velocity_odom_mps(self) -> tuple[float, float]:
        """The velocity of the base in odom."""
        cos, sin = math.cos(self.heading_odom_rad), math.sin(self.heading_odom_rad)
        forward, left = self.speed_mps, self.lateral_mps
        return forward * cos - left * sin, forward * sin + left * cos
