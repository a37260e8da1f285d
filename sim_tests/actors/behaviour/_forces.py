"""Forces that push a walker away from people, the robot, racks and walls, and ways round a robot.

The social force of Helbing and Molnár 1995 (Physical Review E 51, 4282-4286) with the parameters
that Moussaïd et al. 2009 (Proceedings of the Royal Society B 276, 2755-2762) measured:
A = 4.5 m/s², γ = 0.35, n = 2, n' = 3, λ = 2. Walls push with 3 m/s² · exp(-d/0.1 m). A walker
reaches the desired velocity with a relaxation time of 0.54 s. All forces are accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

from ._route import DesiredVelocity
from ._surroundings import MovingBody, RobotBody

#: Time constant with which a walker reaches the desired velocity.
RELAXATION_S: Final = 0.54

_STRENGTH_MPS2: Final = 4.5  # A
_REACH_S: Final = 0.35  # gamma: reach per speed of the interaction
_ACROSS: Final = 2.0  # n
_ALONG: Final = 3.0  # n'
_FORESIGHT_S: Final = 2.0  # lambda
_WALL_MPS2: Final = 3.0
_WALL_REACH_M: Final = 0.1
_RANGE_M: Final = 5.0
# The force is defined between the centres of two people. The nearest side of a robot counts as the
# surface of a person, whose centre lies this far behind it.
_SHOULDER_M: Final = 0.25
# Ways lead round robots, and stop short of them, within this distance.
_AVOIDED_WITHIN_M: Final = 3.0
# A slower robot is walked around like an obstacle, with this clearance.
_SLOW_MPS: Final = 0.15
_CLEARANCE_M: Final = 0.45
# A person walks no faster towards the robot than covers the distance beyond the standoff in this
# time.
_APPROACH_S: Final = 0.5


def people_force(
    x_m: float, y_m: float, vx_mps: float, vy_mps: float, others: Iterable[MovingBody]
) -> tuple[float, float]:
    """Return the acceleration (m/s²) of a walker away from other people."""
    ax = ay = 0.0
    for other in others:
        dx, dy = other.x_m - x_m, other.y_m - y_m
        if dx * dx + dy * dy < _RANGE_M * _RANGE_M:
            px, py = _interaction(dx, dy, vx_mps - other.vx_mps, vy_mps - other.vy_mps)
            ax += px
            ay += py
    return ax, ay


def robot_force(
    x_m: float, y_m: float, vx_mps: float, vy_mps: float, robot: RobotBody
) -> tuple[float, float]:
    """Return the acceleration (m/s²) of a walker away from the nearest point of the robot."""
    near_x, near_y = robot.nearest_point_m(x_m, y_m)
    dx, dy = near_x - x_m, near_y - y_m
    gap = math.hypot(dx, dy)
    if gap > _RANGE_M:
        return 0.0, 0.0
    if gap < 1e-6:
        dx, dy, gap = robot.x_m - x_m, robot.y_m - y_m, 1e-6
    scale = (gap + _SHOULDER_M) / max(math.hypot(dx, dy), 1e-6)
    return _interaction(dx * scale, dy * scale, vx_mps - robot.vx_mps, vy_mps - robot.vy_mps)


def box_force(
    x_m: float, y_m: float, box: tuple[float, float, float, float], radius_m: float
) -> tuple[float, float]:
    """Return the acceleration (m/s²) of a walker of this radius away from a rack or a wall."""
    dx = x_m - min(max(x_m, box[0]), box[2])
    dy = y_m - min(max(y_m, box[1]), box[3])
    distance = math.hypot(dx, dy)
    if distance < 1e-6 or distance > radius_m + 8.0 * _WALL_REACH_M:
        return 0.0, 0.0
    size = _WALL_MPS2 * math.exp(-max(distance - radius_m, 0.0) / _WALL_REACH_M) / distance
    return size * dx, size * dy


def _interaction(dx: float, dy: float, closing_x: float, closing_y: float) -> tuple[float, float]:
    """Return the force from a person at (dx, dy), approached with this relative velocity."""
    distance = math.hypot(dx, dy)
    if distance < 1e-6:
        return 0.0, 0.0
    ex, ey = dx / distance, dy / distance
    # The interaction vector: the relative velocity and the direction to the other person.
    ix, iy = _FORESIGHT_S * closing_x + ex, _FORESIGHT_S * closing_y + ey
    size = math.hypot(ix, iy)
    if size < 1e-6:
        return 0.0, 0.0
    tx, ty = ix / size, iy / size
    angle = math.atan2(tx * ey - ty * ex, tx * ex + ty * ey)
    reach = _REACH_S * size
    base = _STRENGTH_MPS2 * math.exp(-distance / reach)
    slower = base * math.exp(-((_ALONG * reach * angle) ** 2))
    # Head on, people step to the right, as on the European continent (Moussaïd et al. 2009).
    aside = base * math.exp(-((_ACROSS * reach * angle) ** 2)) * (1.0 if angle > -0.005 else -1.0)
    return -slower * tx + aside * ty, -slower * ty - aside * tx


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
        if not slow or desired.speed_mps <= 0.0 or ahead <= 0.0 or distance > _AVOIDED_WITHIN_M:
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
    if away > _AVOIDED_WITHIN_M or away < 1e-6:
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
