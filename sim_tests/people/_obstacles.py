"""Racks and walls as a walker meets them: they push, and nobody gets through."""

from __future__ import annotations

import math
from typing import Any, Final

from .._errors import SimError
from ._social_force import push_of_box

Box = tuple[float, float, float, float]

#: Half the breadth of a body: a walker's middle stays this far from racks.
BODY_M: Final = 0.25
# Boxes farther away are not looked at until the walker has come so far.
_NEAR_M: Final = 3.0
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
            self._near = [box for box in self._boxes if _distance(self._from, box) < _NEAR_M]
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
