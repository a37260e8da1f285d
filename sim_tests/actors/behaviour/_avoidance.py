"""Avoidance of a known robot: around a slow one, and never straight into one."""

from __future__ import annotations

import math
from typing import Final

from ._person import RobotBody
from ._route import DesiredVelocity

# Robots farther away are ignored.
_RANGE_M: Final = 3.0
# A slower robot is walked around like an obstacle, with this clearance.
_SLOW_MPS: Final = 0.15
_CLEARANCE_M: Final = 0.45
# A person walks no faster towards the robot than covers the distance beyond the standoff in this
# time.
_APPROACH_S: Final = 0.5


class SlowRobotDetour:
    """A detour around a slow robot in the way, on one side of it until it is passed."""

    def __init__(self) -> None:
        self._side = 0.0  # +1 passes with the robot on the right, −1 on the left

    def steer(
        self, desired: DesiredVelocity, x: float, y: float, robot: RobotBody
    ) -> DesiredVelocity:
        """Return the desired velocity of a person at (x, y), turned to pass a slow robot."""
        dx, dy = robot.x_m - x, robot.y_m - y
        distance = math.hypot(dx, dy)
        ahead = dx * desired.ux + dy * desired.uy
        slow = math.hypot(robot.vx_mps, robot.vy_mps) < _SLOW_MPS
        if not slow or desired.speed_mps <= 0.0 or ahead <= 0.0 or distance > _RANGE_M:
            self._side = 0.0
            return desired
        robot_left_m = desired.ux * dy - desired.uy * dx
        clearance_m = math.hypot(robot.half_length_m, robot.half_width_m) + _CLEARANCE_M
        if abs(robot_left_m) >= clearance_m:
            return desired
        if self._side == 0.0:
            self._side = -1.0 if robot_left_m > 0.0 else 1.0
        # Along the tangent of the clearance circle; straight to the side from inside of it.
        off = math.asin(min(clearance_m / max(distance, 1e-6), 1.0))
        course = math.atan2(dy, dx) + self._side * off
        return DesiredVelocity(math.cos(course), math.sin(course), desired.speed_mps)


def limit_approach(
    desired: DesiredVelocity, x: float, y: float, robot: RobotBody, standoff_m: float
) -> DesiredVelocity:
    """Return the desired velocity of a person at (x, y), without walking into the robot.

    The standoff is the distance from the body's centre to the robot.
    """
    near_x, near_y = robot.nearest_point_m(x, y)
    dx, dy = near_x - x, near_y - y
    away = math.hypot(dx, dy)
    if away > _RANGE_M or away < 1e-6:
        return desired
    nx, ny = dx / away, dy / away
    vx, vy = desired.speed_mps * desired.ux, desired.speed_mps * desired.uy
    limit = max(away - standoff_m, 0.0) / _APPROACH_S
    excess = max(vx * nx + vy * ny - limit, 0.0)
    if excess <= 0.0:
        return desired
    vx, vy = vx - excess * nx, vy - excess * ny
    speed = math.hypot(vx, vy)
    if speed < 1e-6:
        return DesiredVelocity(desired.ux, desired.uy, 0.0)
    return DesiredVelocity(vx / speed, vy / speed, speed)


def without_part(vx: float, vy: float, nx: float, ny: float) -> tuple[float, float]:
    """Return a velocity without its part along a direction; the opposite part stays."""
    along = max(vx * nx + vy * ny, 0.0)
    return vx - along * nx, vy - along * ny
