"""Forces that push a walker away from people, the robot, racks and walls.

The social force of Helbing and Molnár 1995 (Physical Review E 51, 4282-4286) with the parameters
that Moussaïd et al. 2009 (Proceedings of the Royal Society B 276, 2755-2762) measured:
A = 4.5 m/s², γ = 0.35, n = 2, n' = 3, λ = 2. Walls push with 3 m/s² · exp(-d/0.1 m). A walker
reaches the desired velocity with a relaxation time of 0.54 s. All forces are accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

from ._person import MovingBody, RobotBody

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
