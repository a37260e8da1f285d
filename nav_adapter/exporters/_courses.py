"""Courses of the robot at many poses, and where on them it meets people, in single precision.

Values are numbers, or arrays of one number per pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from perception.arrays import FloatArray

from .._robot import RobotProfile
from ..course import Course, course_of, driven_since_m
from ..rigid import Motion

Value = Any
#: Instead of an infinite way.
NOWHERE_M: Final = np.float32(1e9)
# What is less than this far on the other side counts as on this side, for rounding.
_NEAR_M: Final = np.float32(1e-5)


def courses_at(
    robot: RobotProfile,
    positions_m: FloatArray,
    headings_rad: Value,
    velocities_mps: tuple[Value, Value] | None,
    yaw_rates_radps: Value,
    age_s: float,
) -> Course:
    """Return the courses at poses (N, 2), as :func:`~nav_adapter.course.course_of` has them.

    Without headings (None) a robot may go anywhere at once: only its circle counts, ``radius_m``.
    Without velocities it drives forwards.
    """
    forward, left = (robot.max_speed_mps, 0.0) if velocities_mps is None else velocities_mps
    heading = 0.0 if headings_rad is None else headings_rad
    x, y = positions_m.T
    motion = Motion(x, y, heading, forward, left, yaw_rates_radps)
    course = course_of(robot, motion, 0.0, age_s, np)
    if headings_rad is None:
        driven_m = driven_since_m(robot, np.hypot(forward, left), age_s, np)
        course = course._replace(
            front_m=driven_m, rear_m=0.0, half_m=0.0, circle_m=robot.circumscribed_radius_m
        )
    single = (np.asarray(value, dtype=np.float32) for value in course[2:10])
    cos, sin, fan_cos, fan_sin, front, rear, half, radius = single
    return course._replace(
        cos=cos,
        sin=sin,
        fan_cos=fan_cos,
        fan_sin=fan_sin,
        front_m=front + _NEAR_M,
        rear_m=rear - _NEAR_M,
        half_m=half + _NEAR_M,
        radius_m=radius + _NEAR_M,
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
    low_x = np.where(low_y < 0.0, distance, cos_x + sin_y)
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
