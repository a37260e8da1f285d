"""Round a robot that stands in the way, and never with open eyes into one."""

from __future__ import annotations

import math
from typing import Final

from ._meeting import Intent
from ._surroundings import RobotBody

# A robot this slow is walked around like a thing; from so far on, with so much room.
_SLOW_MPS: Final = 0.15
_FROM_M: Final = 3.0
_ROOM_M: Final = 0.45
# From the middle of the body to what it would touch, with a little to spare; and how soon before
# one slows down for it.
_STANDOFF_M: Final = 0.45
_STANDOFF_S: Final = 0.5


class Detour:
    """Keeps to one side of a robot in the way until it is passed."""

    def __init__(self) -> None:
        self._side = 0.0

    def around(self, intent: Intent, x: float, y: float, robot: RobotBody) -> Intent:
        """The intent, turned to pass the robot if it stands across it.

        Args:
            intent: what is wanted.
            x: of the person.
            y: of the person.
            robot: as far as the person knows.
        """
        dx, dy = robot.x_m - x, robot.y_m - y
        distance = math.hypot(dx, dy)
        ahead = dx * intent.x + dy * intent.y
        slow = math.hypot(robot.vx_mps, robot.vy_mps) < _SLOW_MPS
        if not slow or intent.speed_mps <= 0.0 or ahead <= 0.0 or distance > _FROM_M:
            self._side = 0.0
            return intent
        left = intent.x * dy - intent.y * dx  # of the way, the robot is
        room = math.hypot(robot.half_length_m, robot.half_width_m) + _ROOM_M
        if abs(left) >= room:
            return intent
        if self._side == 0.0:
            self._side = -1.0 if left > 0.0 else 1.0
        # Along the tangent of a circle around it; straight aside from within.
        off = math.asin(min(room / max(distance, 1e-6), 1.0))
        course = math.atan2(dy, dx) + self._side * off
        return Intent(math.cos(course), math.sin(course), intent.speed_mps)


def kept_off(intent: Intent, x: float, y: float, robot: RobotBody) -> Intent:
    """The intent, less what of it would lead straight into a robot that is known to be there."""
    near_x, near_y = robot.nearest_m(x, y)
    dx, dy = near_x - x, near_y - y
    away = math.hypot(dx, dy)
    if away > _FROM_M or away < 1e-6:
        return intent
    nx, ny = dx / away, dy / away
    vx, vy = intent.speed_mps * intent.x, intent.speed_mps * intent.y
    allowed = max(away - _STANDOFF_M, 0.0) / _STANDOFF_S
    over = max(vx * nx + vy * ny - allowed, 0.0)
    vx, vy = vx - over * nx, vy - over * ny
    speed = math.hypot(vx, vy)
    if over <= 0.0 or speed < 1e-6:
        return intent if over <= 0.0 else Intent(intent.x, intent.y, 0.0)
    return Intent(vx / speed, vy / speed, speed)
