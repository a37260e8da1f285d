"""Where a body is between two decisions: constant acceleration, and nobody gets into a rack."""

from __future__ import annotations

from ._obstacles import Obstacles

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
