"""Where to head when someone stands between the robot and its goal."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

# Passing on the left has to be this much less of a turn: else the robot keeps right.
_KEEP_RIGHT_RAD = 0.1


def detour_bearing_rad(
    goal_bearing_rad: float,
    goal_distance_m: float,
    discs_m: Sequence[tuple[float, float, float]],
    is_free: Callable[[float, float], bool],
) -> float:
    """Bearing of the goal, or of the tangent past the nearest disc that hides the goal.

    Sampled motions of a few seconds do not find the way round something right in front; the tangent
    of a visibility graph does. Where both sides are closed the goal's bearing stays and the robot
    waits.

    Args:
        goal_bearing_rad: in the base frame.
        goal_distance_m: discs beyond it do not hide it.
        discs_m: (x, y, radius) in the base frame; the radius holds the robot's own half width.
        is_free: whether boxes leave room for the robot at (x, y) m, on its way to the goal.
    """
    for x, y, radius in sorted(discs_m, key=lambda disc: math.hypot(disc[0], disc[1]) - disc[2]):
        distance = math.hypot(x, y)
        if distance >= goal_distance_m or distance < 1e-9:
            continue
        # From inside a disc the way out is square to its centre.
        half_angle = math.asin(min(1.0, radius / distance))
        to_left = math.remainder(math.atan2(y, x) - goal_bearing_rad, math.tau) + half_angle
        to_right = 2.0 * half_angle - to_left
        if to_left <= 0.0 or to_right <= 0.0:
            continue
        # The narrowest place is beside the person: square to the way to the goal.
        beside = radius * math.cos(goal_bearing_rad), radius * math.sin(goal_bearing_rad)
        left = goal_bearing_rad + to_left, (x - beside[1], y + beside[0])
        right = goal_bearing_rad - to_right, (x + beside[1], y - beside[0])
        sides = (left, right) if to_left < to_right - _KEEP_RIGHT_RAD else (right, left)
        return next((bearing for bearing, gate in sides if is_free(*gate)), goal_bearing_rad)
    return goal_bearing_rad
