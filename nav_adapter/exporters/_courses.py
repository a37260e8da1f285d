"""Courses of the robot at many poses, and where on them it meets people, in single precision.

Values are numbers, or arrays of one number per pose.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from perception.arrays import FloatArray

from .._robot import LATERAL_NOISE_MPS, RobotProfile
from .._speed_basis import SpeedBasis
from ..limit import STANDING_MPS

Value = Any
#: Instead of an infinite way.
NOWHERE_M: Final = np.float32(1e9)
# What is less than this far on the other side counts as on this side, for rounding.
_NEAR_M: Final = np.float32(1e-5)


@dataclass(frozen=True, slots=True)
class Courses:
    """Courses of the robot at N poses; see :class:`~nav_adapter.limit.Course`.

    Attributes:
        x_m: (N,) place of the base.
        y_m: (N,).
        driven_m: how far the robot may have driven since its state.
        cos: direction of the middle of the fan, or None for a robot that may go anywhere at once.
        sin: the same.
        fan_cos: half the opening of the fan.
        fan_sin: the same.
        front_m: of the footprint.
        rear_m: the same.
        half_m: the same.
        radius_m: no part of the robot is farther from the base of its course.
        straight: cosine and sine of the straight course, and front, rear and half the width along
            it.
    """

    x_m: FloatArray
    y_m: FloatArray
    driven_m: Value
    cos: Value = None
    sin: Value = None
    fan_cos: Value = -1.0
    fan_sin: Value = 0.0
    front_m: Value = 0.0
    rear_m: Value = 0.0
    half_m: Value = 0.0
    radius_m: Value = 0.0
    straight: tuple[Value, ...] = ()

    def straight_on(self) -> Courses:
        """Return the courses of a robot that goes straight on, without a fan."""
        if not self.straight:
            return self
        cos, sin, front, rear, half = self.straight
        return replace(
            self,
            **{"cos": cos, "sin": sin, "fan_cos": np.float32(1.0), "fan_sin": np.float32(0.0)},
            **{"front_m": front, "rear_m": rear, "half_m": half},
        )


def courses_of(
    robot: RobotProfile,
    basis: SpeedBasis,
    positions_m: FloatArray,
    headings_rad: FloatArray | None,
    velocities_mps: tuple[FloatArray, Value] | None,
    yaw_rates_radps: Value,
    anywhere: bool = False,
) -> Courses:
    """Return the courses at poses (N, 2), as :func:`~nav_adapter.limit.courses_of` has them.

    A robot that stands has one fan of all directions, whichever end leads.

    Args:
        robot: of the constraints.
        basis: of the constraints.
        positions_m: (N, 2).
        headings_rad: (N,), or None for any.
        velocities_mps: forward and left, (N,), or None for a robot that drives forwards.
        yaw_rates_radps: (N,), or 0.
        anywhere: the robots stand, and may start in any direction.
    """
    x, y = positions_m.T
    age_s = basis.robot_age_s
    if velocities_mps is None:
        travel: Value = robot.max_speed_mps
    else:
        forward, left = velocities_mps
        travel = np.hypot(forward, left)
    fastest = np.maximum(travel, robot.max_speed_mps)
    faster_m = 0.5 * robot.max_acceleration_mps2 * age_s**2
    driven_m = np.minimum(travel * age_s + faster_m, fastest * age_s)
    radius_m = robot.circumscribed_radius_m + driven_m + _NEAR_M
    if headings_rad is None:
        return Courses(x, y, _single(driven_m), radius_m=_single(radius_m))
    turn_rad = 0.0 if basis.policy.reach is None else math.radians(basis.policy.reach.turn_deg)
    off: Value = 0.0
    speed: Value = travel
    noise_rad: Value = 0.0
    stands: Value = False
    if velocities_mps is not None:
        sideways, speed = np.abs(left) > LATERAL_NOISE_MPS, course_speed_mps(forward, left)
        off = np.where(forward <= -STANDING_MPS, math.pi, 0.0)
        off = np.where(sideways, np.arctan2(left, forward), off)
        if robot.moves_sideways is not False:
            noise_rad = np.arctan2(np.abs(left), np.maximum(speed, STANDING_MPS))
            noise_rad = np.where(sideways, 0.0, noise_rad)
        stands = stands_at(forward, left)
    straight_rad = headings_rad + off
    extent = extents_m(robot, off)
    straight = (*_directions(straight_rad), *extent)
    if anywhere:
        return Courses(x, y, _single(driven_m), radius_m=_single(radius_m), straight=straight)
    # The chord of a curve, as in course_of.
    stopping_s = robot.reaction_time_s + age_s + 0.5 * speed / robot.max_deceleration_mps2
    half_rad = 0.5 * np.clip(yaw_rates_radps * stopping_s, -math.pi, math.pi)
    fan_rad = np.minimum(turn_rad + noise_rad + 0.5 * np.abs(half_rad), math.pi)
    swing_rad = np.abs(half_rad) + noise_rad
    middle = straight
    if np.any(swing_rad):
        swung = _swung(robot, extent, swing_rad)
        middle = (*_directions(straight_rad + 0.5 * half_rad), *swung)
    cos, sin, front, rear, half = middle
    if np.any(stands):
        fan_rad = np.where(stands, math.pi, fan_rad)
        long = np.maximum(front, -rear)
        front, rear = np.where(stands, long, front), np.where(stands, -long, rear)
    fan_cos, fan_sin = _directions(fan_rad)
    return Courses(
        *(x, y, _single(driven_m), cos, sin, fan_cos, fan_sin, front, rear, half),
        _single(radius_m),
        straight,
    )


def course_speed_mps(forward: Value, left: Value) -> Value:
    """Return the speed on the course: lateral noise does not count."""
    return np.where(np.abs(left) > LATERAL_NOISE_MPS, np.hypot(forward, left), np.abs(forward))


def stands_at(forward: Value, left: Value) -> Value:
    """Return whether a robot stands, so that it may start either way."""
    return (np.abs(left) <= LATERAL_NOISE_MPS) & (np.abs(forward) < STANDING_MPS)


def _single(value: Value) -> Value:
    return np.asarray(value, dtype=np.float32)


def _directions(angle_rad: Value) -> tuple[Value, Value]:
    """Return cosine and sine in single precision."""
    return _single(np.cos(angle_rad)), _single(np.sin(angle_rad))


def extents_m(robot: RobotProfile, off_rad: Value) -> tuple[Value, Value, Value]:
    """Return front, rear and half the width along a course ``off_rad`` from the heading."""
    if not np.any(off_rad):
        off_rad = 0.0
    cos, sin = _directions(off_rad)
    front, rear, half = -np.inf, np.inf, 0.0
    for x, y in robot.footprint_m.astype(np.float32):
        along, across = cos * x + sin * y, cos * y - sin * x
        front, rear = np.maximum(front, along), np.minimum(rear, along)
        half = np.maximum(half, np.abs(across))
    return front + _NEAR_M, rear - _NEAR_M, half + _NEAR_M


def _swung(
    robot: RobotProfile, extent_m: tuple[Value, Value, Value], swing_rad: Value
) -> tuple[Value, Value, Value]:
    """Return what they are for a footprint turned by up to ``swing_rad`` either way."""
    (front, rear, half), radius = extent_m, np.float32(robot.circumscribed_radius_m + _NEAR_M)
    cos, sin = _directions(np.minimum(swing_rad, 0.5 * math.pi))
    long = np.maximum(front, -rear)
    wide = np.minimum(half * cos + long * sin, radius)
    wide = np.where(half * sin < long * cos - _NEAR_M, wide, radius)
    return (
        np.where(sin > 0.0, np.minimum(front + half * sin, radius), front),
        np.where(sin > 0.0, np.maximum(rear - half * sin, -radius), rear),
        np.where(sin > 0.0, wide, half),
    )


@dataclass(slots=True)
class Pairs:
    """Pairs of a pose and a person in a time, as arrays (n,) or numbers that all have.

    Attributes:
        row: of the tables.
        x_m: place along the middle of the fan, from the base.
        y_m: the same across it.
        velocity_x_mps: along it.
        velocity_y_mps: across it.
        fan_cos: of the course; None for a robot that may go anywhere at once.
        fan_sin: the same.
        front_m: the same.
        rear_m: the same.
        half_m: the same.
        radius_m: the same.
    """

    row: Any
    x_m: Value
    y_m: Value
    velocity_x_mps: Value
    velocity_y_mps: Value
    fan_cos: Value
    fan_sin: Value
    front_m: Value
    rear_m: Value
    half_m: Value
    radius_m: Value

    def at(self, chosen: Any) -> Pairs:
        """Return some of the pairs."""
        return Pairs(*(chosen_of(getattr(self, name), chosen) for name in self.__slots__))


def chosen_of(value: Value, chosen: Any) -> Value:
    return value[chosen] if isinstance(value, np.ndarray) and value.ndim else value


def in_table(table: Any, part: Any, row: Any) -> Value:
    """Return the values of a table (J, rows), or of one with one column."""
    if table.shape[1] == 1:
        return table[part, 0]
    return table[part].take(row) if isinstance(part, int) else table[part, row]


def stopping_mps(gap_m: Any, react_s: Value, deceleration_mps2: Any) -> Any:
    """Return the speeds at which the robot stops within ``gap_m``."""
    twice_m = 2.0 * np.maximum(gap_m, 0.0)
    slower = np.sqrt(react_s * react_s + twice_m / deceleration_mps2) + react_s
    return twice_m / (slower + np.float32(1e-30))


def contacts_m(
    along: Any, across: Any, pairs: Pairs, reach: Any, margin: Any
) -> tuple[Any, Any, Any]:
    """Return what :func:`~nav_adapter.limit.contact_m` does; the third is None if all are −∞."""
    cos, sin, half = pairs.fan_cos, pairs.fan_sin, pairs.half_m
    x, y = along, np.abs(across)
    rho, side = reach + margin, half + margin
    distance2 = x * x + y * y
    distance = np.sqrt(distance2)
    cos_x, sin_x, cos_y, sin_y = cos * x, sin * x, cos * y, sin * y
    low_y = cos_y - sin_x
    low_x = np.where(low_y <= 0.0, distance, cos_x + sin_y)
    np.maximum(low_y, 0.0, out=low_y)
    high_y = cos_y + sin_x
    high_x = np.where(high_y < 0.0, -distance, cos_x - sin_y)
    wide = rho + half
    ahead = (low_x >= -_NEAR_M) & (low_y < wide)
    low_y -= side
    np.maximum(low_y, 0.0, out=low_y)
    reach2 = reach * reach
    past = np.sqrt(np.maximum(reach2 - low_y * low_y, 0.0)) + (low_x - pairs.rear_m)
    ahead &= past >= -_NEAR_M
    share = half / np.maximum(distance - rho, half)
    at = np.maximum(distance * np.sqrt(1.0 - share * share), high_x)
    np.minimum(at, low_x, out=at)
    off = np.sqrt(np.maximum(distance2 - at * at, 0.0))
    off -= half
    np.maximum(off, 0.0, out=off)
    near = at - np.sqrt(np.maximum(rho * rho - off * off, 0.0)) - pairs.front_m
    beyond = distance - (rho + pairs.radius_m)  # what touches it is farther ahead
    np.maximum(near, beyond, out=near)
    near = np.where(ahead, near, NOWHERE_M)
    backward = (high_x < _NEAR_M) & (high_y < wide) & (beyond <= _NEAR_M)
    if not backward.any():
        return near, past, None
    share = side / np.maximum(distance - reach, side)
    at = np.minimum(-distance * np.sqrt(1.0 - share * share), low_x)
    at = np.maximum(np.minimum(at, 0.0), high_x)
    off = np.maximum(np.sqrt(np.maximum(distance2 - at * at, 0.0)) - side, 0.0)
    end = at - pairs.rear_m + np.sqrt(np.maximum(reach2 - off * off, 0.0))
    return near, past, np.where(backward, end, -np.inf)
