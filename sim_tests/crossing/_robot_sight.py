"""Lines of sight from people to the robot's camera, and collision bodies that lag behind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from ..actors.body import Worker
from ..actors.robot import Amr
from ..world import Warehouse, sees

Point = tuple[float, float]

# Collision bodies farther than this from a line or from the robot's base never touch either.
_BESIDE_LINE_M: Final = 1.5
_BESIDE_ROBOT_M: Final = 4.5
# A line that passes boxes at this distance and stays above the floor by it meets none of them.
_CLEAR_M: Final = 0.1


class RobotSight:
    """Tests whether people see the robot's camera.

    Most lines of sight are free of boxes and of other people by far. They need no ray through the
    physics, and so no collision bodies at the present postures.

    Args:
        warehouse: with the boxes.
        amr: the robot; it does not hide its own camera.
        workers: the people.
    """

    def __init__(self, warehouse: Warehouse, amr: Amr, workers: Sequence[Worker]) -> None:
        self._amr = amr
        self._workers = workers
        self._through = frozenset({amr.body})
        self._boxes = [
            (
                0.5 * (x_low + x_high),
                0.5 * (y_low + y_high),
                0.5 * (x_high - x_low),
                0.5 * (y_high - y_low),
            )
            for x_low, y_low, x_high, y_high in warehouse.obstacle_boxes_odom.tolist()
        ]

    def seen_by(self, worker: Worker) -> bool:
        """Return whether nothing stands between a person's eyes and the camera."""
        camera = self._amr.T_odom_camera[:3, 3]
        ex, ey, ez = worker.eyes_odom_m.tolist()
        cx, cy, cz = camera.tolist()
        beside = [other for other in self._workers if _near_line(other, (ex, ey), (cx, cy))]
        alone = all(other is worker for other in beside)
        if alone and min(ez, cz) > _CLEAR_M and not self._passes_boxes((ex, ey), (cx, cy)):
            return True
        for other in beside:
            other.place_collision_body()
        return sees(worker, camera, through=self._through)

    def _passes_boxes(self, start: Point, end: Point) -> bool:
        """Return whether a line passes a box on the floor plan nearer than the tolerance."""
        half_x, half_y = 0.5 * (end[0] - start[0]), 0.5 * (end[1] - start[1])
        middle_x, middle_y = start[0] + half_x, start[1] + half_y
        reach_x, reach_y = abs(half_x) + _CLEAR_M, abs(half_y) + _CLEAR_M
        for x, y, half_length, half_width in self._boxes:
            dx, dy = middle_x - x, middle_y - y
            # A line and a box are apart if they are along x, along y, or across the line.
            if abs(dx) > half_length + reach_x or abs(dy) > half_width + reach_y:
                continue
            apart = abs(dx * half_y - dy * half_x)
            if apart <= (half_length + _CLEAR_M) * abs(half_y) + (half_width + _CLEAR_M) * abs(
                half_x
            ):
                return True
        return False


def near_robot(worker: Worker, place_odom_m: Point, robot_odom_m: Point) -> bool:
    """Return whether a person, or the collision body left behind, may come near the robot."""
    return (
        math.dist(place_odom_m, robot_odom_m) <= _BESIDE_ROBOT_M
        or math.dist(worker.collision_place_odom_m, robot_odom_m) <= _BESIDE_ROBOT_M
    )


def _near_line(worker: Worker, start: Point, end: Point) -> bool:
    """Return whether a person, or the collision body left behind, may touch a line."""
    return any(
        _distance_to_line_m(place, start, end) <= _BESIDE_LINE_M
        for place in (worker.place_odom_m, worker.collision_place_odom_m)
    )


def _distance_to_line_m(place: Point, start: Point, end: Point) -> float:
    along_x, along_y = end[0] - start[0], end[1] - start[1]
    off_x, off_y = place[0] - start[0], place[1] - start[1]
    squared = max(along_x * along_x + along_y * along_y, 1e-12)
    share = min(max((off_x * along_x + off_y * along_y) / squared, 0.0), 1.0)
    return math.hypot(off_x - share * along_x, off_y - share * along_y)
