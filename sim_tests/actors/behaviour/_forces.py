"""What pushes people apart: the social force of Helbing and Molnár, with measured parameters.

Helbing and Molnár 1995, Physical Review E 51, 4282-4286. The force between two people is the one
that Moussaïd et al. 2009, Proceedings of the Royal Society B 276, 2755-2762, measured in
experiments: A = 4.5 m/s², γ = 0.35, n = 2, n' = 3, λ = 2; walls push with 3 m/s² · exp(-d/0.1 m);
a free walk is taken up with a relaxation time of 0.54 s. Forces are accelerations.


Racks and walls as a walker meets them: they push, and nobody gets through.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Final

from ...world.errors import SimError
from ._person import MovingBody, RobotBody

#: Time in which a walker takes up the speed and the direction that are wanted.
RELAXATION_S: Final = 0.54

_STRENGTH_MPS2: Final = 4.5
_REACH_S: Final = 0.35  # gamma: reach per speed of the interaction
_ACROSS: Final = 2.0  # n
_ALONG: Final = 3.0  # n'
_FORESIGHT_S: Final = 2.0  # lambda
_WALL_MPS2: Final = 3.0
_WALL_REACH_M: Final = 0.1
# People farther away than this leave one alone.
_NEAR_M: Final = 5.0
# From the middle of a person to what another would keep away from: the force is one between the
# middles of two people, a robot's nearest side counts as the surface of one.
_SHOULDER_M: Final = 0.25


def push_of_people(
    x_m: float, y_m: float, vx_mps: float, vy_mps: float, others: Iterable[MovingBody]
) -> tuple[float, float]:
    """Acceleration (m/s²) of somebody here, moving so, away from all others."""
    ax = ay = 0.0
    for other in others:
        dx, dy = other.x_m - x_m, other.y_m - y_m
        if dx * dx + dy * dy < _NEAR_M * _NEAR_M:
            px, py = _push(dx, dy, vx_mps - other.vx_mps, vy_mps - other.vy_mps)
            ax += px
            ay += py
    return ax, ay


def push_of_robot(
    x_m: float, y_m: float, vx_mps: float, vy_mps: float, robot: RobotBody
) -> tuple[float, float]:
    """Acceleration (m/s²) away from a robot that one knows of, by the nearest point of it."""
    near_x, near_y = robot.nearest_m(x_m, y_m)
    dx, dy = near_x - x_m, near_y - y_m
    gap = math.hypot(dx, dy)
    if gap > _NEAR_M:
        return 0.0, 0.0
    if gap < 1e-6:
        dx, dy, gap = robot.x_m - x_m, robot.y_m - y_m, 1e-6
    reach = (gap + _SHOULDER_M) / max(math.hypot(dx, dy), 1e-6)
    return _push(dx * reach, dy * reach, vx_mps - robot.vx_mps, vy_mps - robot.vy_mps)


def push_of_box(
    x_m: float, y_m: float, box: tuple[float, float, float, float], body_m: float
) -> tuple[float, float]:
    """Acceleration (m/s²) of a body of this radius away from a rack or a wall."""
    dx = x_m - min(max(x_m, box[0]), box[2])
    dy = y_m - min(max(y_m, box[1]), box[3])
    distance = math.hypot(dx, dy)
    if distance < 1e-6 or distance > body_m + 8.0 * _WALL_REACH_M:
        return 0.0, 0.0
    size = _WALL_MPS2 * math.exp(-max(distance - body_m, 0.0) / _WALL_REACH_M) / distance
    return size * dx, size * dy


def _push(dx: float, dy: float, closing_x: float, closing_y: float) -> tuple[float, float]:
    """Force from somebody at (dx, dy), whom one approaches with this relative velocity."""
    distance = math.hypot(dx, dy)
    if distance < 1e-6:
        return 0.0, 0.0
    ex, ey = dx / distance, dy / distance
    # The interaction vector: mostly the approach, and the line between the two.
    ix, iy = _FORESIGHT_S * closing_x + ex, _FORESIGHT_S * closing_y + ey
    size = math.hypot(ix, iy)
    if size < 1e-6:
        return 0.0, 0.0
    tx, ty = ix / size, iy / size
    angle = math.atan2(tx * ey - ty * ex, tx * ex + ty * ey)
    reach = _REACH_S * size
    base = _STRENGTH_MPS2 * math.exp(-distance / reach)
    slower = base * math.exp(-((_ALONG * reach * angle) ** 2))
    # Whoever comes straight on is given way to the right: a small preference that breaks the tie,
    # as people on the European continent have (ibid.).
    aside = base * math.exp(-((_ACROSS * reach * angle) ** 2)) * (1.0 if angle > -0.005 else -1.0)
    return -slower * tx + aside * ty, -slower * ty - aside * tx


Box = tuple[float, float, float, float]

#: Half the breadth of a body: a walker's middle stays this far from racks.
BODY_M: Final = 0.25
# Boxes farther away are not looked at until the walker has come so far.
_NEAR_BOX_M: Final = 3.0
_LOOK_AGAIN_M: Final = 1.5
_PASSES: Final = 3


class Obstacles:
    """The boxes around one walker.

    Args:
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max.
    """

    def __init__(self, boxes_odom_m: Any) -> None:
        self._boxes: list[Box] = [(a, b, c, d) for a, b, c, d in boxes_odom_m.tolist()]
        self._near: list[Box] = []
        self._from: tuple[float, float] | None = None

    def refuse(self, what: str, x_m: float, y_m: float) -> None:
        """Raise SimError for a point inside a box."""
        for x_min, y_min, x_max, y_max in self._boxes:
            if x_min < x_m < x_max and y_min < y_m < y_max:
                raise SimError(
                    f"{what} lies inside a rack, a wall or a prop that spans x {x_min:g} to "
                    f"{x_max:g} m, y {y_min:g} to {y_max:g} m; got ({x_m:g}, {y_m:g}) m"
                )

    def push(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Acceleration (m/s²) away from all boxes."""
        ax = ay = 0.0
        for box in self._around(x_m, y_m):
            px, py = push_of_box(x_m, y_m, box, BODY_M)
            ax += px
            ay += py
        return ax, ay

    def held_off(
        self, from_xy: tuple[float, float], to_xy: tuple[float, float]
    ) -> tuple[float, float]:
        """Where somebody gets to who wants to go a short way: never nearer to a box than a body.

        Whoever stood nearer before gets no nearer still.
        """
        near = self._around(*from_xy)
        margins = [min(BODY_M, _distance(from_xy, box)) for box in near]
        x, y = to_xy
        for _ in range(_PASSES):
            moved = False
            for box, margin in zip(near, margins, strict=True):
                if _distance((x, y), box) < margin - 1e-9:
                    x, y = _pushed_out(x, y, from_xy, box, margin)
                    moved = True
            if not moved:
                return x, y
        # A corner too narrow to find a way out of at once.
        return from_xy

    def _around(self, x_m: float, y_m: float) -> list[Box]:
        if self._from is None or math.dist(self._from, (x_m, y_m)) > _LOOK_AGAIN_M:
            self._from = (x_m, y_m)
            self._near = [box for box in self._boxes if _distance(self._from, box) < _NEAR_BOX_M]
        return self._near


def _distance(point: tuple[float, float], box: Box) -> float:
    x, y = point
    return math.hypot(
        x - min(max(x, box[0]), box[2]),
        y - min(max(y, box[1]), box[3]),
    )


def _pushed_out(
    x: float, y: float, from_xy: tuple[float, float], box: Box, margin: float
) -> tuple[float, float]:
    """The nearest point with this margin on the side from which the walker came."""
    near_x, near_y = min(max(x, box[0]), box[2]), min(max(y, box[1]), box[3])
    away = math.hypot(x - near_x, y - near_y)
    if away > 1e-9:
        return near_x + (x - near_x) * margin / away, near_y + (y - near_y) * margin / away
    near_x = min(max(from_xy[0], box[0]), box[2])
    near_y = min(max(from_xy[1], box[1]), box[3])
    away = math.dist(from_xy, (near_x, near_y))
    if away < 1e-9:
        return from_xy
    return (
        near_x + (from_xy[0] - near_x) * margin / away,
        near_y + (from_xy[1] - near_y) * margin / away,
    )
