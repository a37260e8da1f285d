"""The direction past a person who stands between the robot and its goal."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

# The robot passes on the left only if that turn is smaller by this much; else it keeps right.
_KEEP_RIGHT_RAD: Final = 0.1


def detour_bearing_rad(
    goal_bearing_rad: float,
    goal_distance_m: float,
    discs_m: Sequence[tuple[float, float, float]],
    is_free: Callable[[float, float], bool],
) -> float:
    """Return the bearing of the goal, or of the tangent past the nearest disc that hides the goal.

    Sampled motions of a few seconds do not find the way around an obstacle right ahead; the tangent
    of a visibility graph does. If both sides are blocked, the bearing stays that of the goal and
    the robot waits.

    Args:
        goal_bearing_rad: bearing of the goal in the base frame.
        goal_distance_m: distance of the goal; discs beyond it do not hide it.
        discs_m: (x, y, radius) in the base frame; the radius includes the robot's half width.
        is_free: whether the robot at (x, y) m is clear of boxes, on its way to the goal.
    """
    for x, y, radius in sorted(discs_m, key=lambda disc: math.hypot(disc[0], disc[1]) - disc[2]):
        distance = math.hypot(x, y)
        if distance >= goal_distance_m or distance < 1e-9:
            continue
        # Inside a disc the direction out is perpendicular to its centre.
        half_angle = math.asin(min(1.0, radius / distance))
        to_left = math.remainder(math.atan2(y, x) - goal_bearing_rad, math.tau) + half_angle
        to_right = 2.0 * half_angle - to_left
        if to_left <= 0.0 or to_right <= 0.0:
            continue
        # The narrowest place is beside the person, perpendicular to the direction of the goal.
        beside = radius * math.cos(goal_bearing_rad), radius * math.sin(goal_bearing_rad)
        left = goal_bearing_rad + to_left, (x - beside[1], y + beside[0])
        right = goal_bearing_rad - to_right, (x + beside[1], y - beside[0])
        sides = (left, right) if to_left < to_right - _KEEP_RIGHT_RAD else (right, left)
        return next((bearing for bearing, place in sides if is_free(*place)), goal_bearing_rad)
    return goal_bearing_rad
