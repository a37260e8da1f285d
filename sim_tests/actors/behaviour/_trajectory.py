"""Motion of a walker between two decisions: constant acceleration, and out of racks and walls."""

from __future__ import annotations

import math
from typing import Final

from ._obstacles import Obstacles

State = tuple[float, float, float, float]  # x, y, vx, vy
#: Largest acceleration of a person who walks.
MAX_ACCELERATION_MPS2: Final = 3.0


class Trajectory:
    """Segments of constant acceleration, one after the other.

    Args:
        x_m: start of the first segment, at rest.
        y_m: start of the first segment.
        obstacles: racks and walls that no segment leads into.

    Attributes:
        acceleration: of the present segment, m/s².
        end: state at the planned end of the present segment.
    """

    def __init__(self, x_m: float, y_m: float, obstacles: Obstacles) -> None:
        self._obstacles = obstacles
        self._start_s = 0.0
        self._start: State = (x_m, y_m, 0.0, 0.0)
        self.acceleration = (0.0, 0.0)
        self.end = self._start

    @property
    def start(self) -> tuple[float, float]:
        """Position at the start of the present segment."""
        return self._start[0], self._start[1]

    def state(self, t_s: float) -> State:
        """Return position and velocity at a time in the present segment."""
        dt_s = t_s - self._start_s
        x, y, vx, vy = self._start
        ax, ay = self.acceleration
        return (
            x + (vx + 0.5 * ax * dt_s) * dt_s,
            y + (vy + 0.5 * ay * dt_s) * dt_s,
            vx + ax * dt_s,
            vy + ay * dt_s,
        )

    def start_segment(
        self, t_s: float, state: State, acceleration: tuple[float, float], duration_s: float
    ) -> None:
        """Start a segment; if it led into a box, constant velocity to a free place replaces it."""
        x, y, vx, vy = state
        ax, ay = acceleration
        goal = (
            x + (vx + 0.5 * ax * duration_s) * duration_s,
            y + (vy + 0.5 * ay * duration_s) * duration_s,
        )
        end = self._obstacles.end_of_step((x, y), goal)
        if end == goal or duration_s <= 0.0:
            self.end = (*goal, vx + ax * duration_s, vy + ay * duration_s)
        else:
            ax = ay = 0.0
            vx, vy = (end[0] - x) / duration_s, (end[1] - y) / duration_s
            self.end = (*end, vx, vy)
        self._start_s, self._start, self.acceleration = t_s, (x, y, vx, vy), (ax, ay)


def limited(x: float, y: float, most: float) -> tuple[float, float]:
    """Return a vector, shortened to this length if it is longer."""
    size = math.hypot(x, y)
    return (x * most / size, y * most / size) if size > most else (x, y)
