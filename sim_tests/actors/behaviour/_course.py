"""Where a body is between two decisions: constant acceleration, and nobody gets into a rack.

Round a robot that stands in the way, and never with open eyes into one.
"""

from __future__ import annotations

import math
from typing import Final

from ._forces import Obstacles
from ._meeting import Intent
from ._person import RobotBody

State = tuple[float, float, float, float]  # x, y, vx, vy


class Course:
    """A body's motion from an instant on.

    Args:
        x_m: where it stands at first.
        y_m: where it stands at first.
        obstacles: what it does not get into.

    Attributes:
        push: acceleration since the instant.
        end: place and velocity that were aimed at when it was set off.
    """

    def __init__(self, x_m: float, y_m: float, obstacles: Obstacles) -> None:
        self._obstacles = obstacles
        self._since_s = 0.0
        self._from: State = (x_m, y_m, 0.0, 0.0)
        self.push = (0.0, 0.0)
        self.end = self._from

    @property
    def start(self) -> tuple[float, float]:
        """Where the body was at the instant."""
        return self._from[0], self._from[1]

    def at(self, t_s: float) -> State:
        """Place and velocity at a time."""
        after_s = t_s - self._since_s
        x, y, vx, vy = self._from
        ax, ay = self.push
        return (
            x + (vx + 0.5 * ax * after_s) * after_s,
            y + (vy + 0.5 * ay * after_s) * after_s,
            vx + ax * after_s,
            vy + ay * after_s,
        )

    def set_off(
        self, since_s: float, state: State, push: tuple[float, float], for_s: float
    ) -> None:
        """Go on from a state with an acceleration; racks and walls hold off."""
        x, y, vx, vy = state
        ax, ay = push
        there = (x + (vx + 0.5 * ax * for_s) * for_s, y + (vy + 0.5 * ay * for_s) * for_s)
        held = self._obstacles.held_off((x, y), there)
        if held == there or for_s <= 0.0:
            self.end = (*there, vx + ax * for_s, vy + ay * for_s)
        else:
            ax = ay = 0.0
            vx, vy = (held[0] - x) / for_s, (held[1] - y) / for_s
            self.end = (*held, vx, vy)
        self._since_s, self._from, self.push = since_s, (x, y, vx, vy), (ax, ay)


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
