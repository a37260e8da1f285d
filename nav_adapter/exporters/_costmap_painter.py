"""People in a costmap that lives on: painted, and taken away again."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._constraints import NavConstraints
from .._errors import NavError
from ._stamps import Cells, checked_brush, checked_costmap, checked_grid, paint, stamps


class CostmapPainter:
    """Keeps people painted in one costmap, and everything else in it as it was.

    Each update takes away what the last one painted and paints anew, as :func:`paint_costmap` does.
    A cell that somebody else has written since keeps what they wrote. That is seen by its value:
    writing just the cost that is there already goes unnoticed, and the cell then gets back what it
    was before the person came. So a static layer that changes is best written between
    :meth:`clear` and :meth:`update`.

    Args:
        costmap: (H, W) uint8, writable; row = y, column = x. It is changed in place.
        origin_odom_m: (2,) lower-left corner of cell (0, 0).
        resolution_m: side of a cell, > 0.
        ring_m: ≥ 0, from the obstacle's edge (Nav2's ``inflation_radius``).
        decay_per_m: > 0 (Nav2's ``cost_scaling_factor``).
        inscribed_radius_m: ≥ 0, of the robot's footprint.

    Raises:
        NavError: an array of another type, shape or dtype, or a number out of bounds.
    """

    def __init__(
        self,
        costmap: NDArray[np.uint8],
        origin_odom_m: Any,
        resolution_m: float,
        *,
        ring_m: float = 0.55,
        decay_per_m: float = 10.0,
        inscribed_radius_m: float = 0.0,
    ) -> None:
        self._costmap = checked_costmap(costmap)
        self._origin, self._resolution = checked_grid(origin_odom_m, resolution_m)
        self._brush = checked_brush(ring_m, inscribed_radius_m, decay_per_m)
        # Windows in the order of painting, with their cells before and after.
        self._painted: list[tuple[tuple[slice, slice], Cells, Cells]] = []

    @property
    def costmap(self) -> NDArray[np.uint8]:
        """(H, W) the array that is painted into."""
        return self._costmap

    def update(self, constraints: NavConstraints) -> tuple[tuple[slice, slice], ...]:
        """Replace the people of the last update by these.

        Returns:
            Windows (rows, columns) that hold every changed cell: the last people's, then these.
        """
        cleared = self.clear()
        shape = self._costmap.shape
        for window, cost in stamps(
            (shape[0], shape[1]), self._origin, self._resolution, constraints, self._brush
        ):
            cells = self._costmap[window]
            before = cells.copy()
            paint(cells, cost)
            self._painted.append((window, before, cells.copy()))
        return (*cleared, *(window for window, _, _ in self._painted))

    def clear(self) -> tuple[tuple[slice, slice], ...]:
        """Take all people away and return the windows (rows, columns) where they were."""
        windows = []
        # Backwards: where windows overlap, the first one remembers the map without people.
        while self._painted:
            window, before, after = self._painted.pop()
            cells = self._costmap[window]
            np.copyto(cells, before, where=cells == after)
            windows.append(window)
        return tuple(windows)

    def move(self, origin_odom_m: Any) -> None:
        """Tell where a rolling map now is. Call :meth:`clear` before its cells are shifted.

        Raises:
            NavError: an origin that is not finite, or people are still painted.
        """
        origin, _ = checked_grid(origin_odom_m, self._resolution)
        if self._painted:
            raise NavError("the costmap must be cleared before it moves, got one with people")
        self._origin = origin
