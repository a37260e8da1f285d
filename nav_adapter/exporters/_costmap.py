"""Obstacles painted into a costmap with the cost values of Nav2, once or to be removed again."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._constraints import NavConstraints
from .._errors import NavError
from ._person_costs import (
    Cells,
    checked_costmap,
    checked_grid,
    checked_profile,
    cost_windows,
    paint,
)


def paint_costmap(
    costmap: NDArray[np.uint8],
    origin_odom_m: Any,
    resolution_m: float,
    constraints: NavConstraints,
    *,
    ring_m: float = 0.55,
    decay_per_m: float = 10.0,
    inscribed_radius_m: float = 0.0,
) -> NDArray[np.uint8]:
    """Paint the obstacles into a costmap, in place.

    A cell whose centre lies within an obstacle's radius r becomes lethal (254). So does the cell
    with the obstacle's centre, so that no obstacle is missed on a coarse grid. Outside, with g the
    distance from the obstacle's edge, costs follow Nav2's inflation layer
    (``InflationLayer::computeCost``): 253 up to the robot's inscribed radius r_i, then
    ⌊252·exp(−k(g − r_i))⌋ up to ``ring_m``. A higher cost in the map is kept. Unknown cells (255)
    become lethal within the radius and stay unknown in the ring. Cells farther away do not change.

    The robot may be inside an obstacle. All cells around it are then lethal, and a planner finds no
    way out (``docs/planners.md``, "Inside a circle").

    The default r_i = 0 is for a planner that checks the robot's footprint, or a map that is
    inflated afterwards. To remove people again, see :class:`CostmapPainter`.

    Args:
        costmap: (H, W) uint8, writable; row = y, column = x.
        origin_odom_m: (2,) lower-left corner of cell (0, 0), as in ``nav_msgs/OccupancyGrid``.
        resolution_m: side of a cell, > 0.
        constraints: the obstacles to paint.
        ring_m: ≥ 0, from the obstacle's edge (Nav2's ``inflation_radius``); at least r_i.
        decay_per_m: k > 0 (Nav2's ``cost_scaling_factor``).
        inscribed_radius_m: r_i ≥ 0, of the robot's footprint.

    Returns:
        The same array.

    Raises:
        NavError: for an array of another type, shape or dtype, or a number out of bounds; the
            costmap does not change then.
    """
    checked_costmap(costmap)
    origin, resolution = checked_grid(origin_odom_m, resolution_m)
    profile = checked_profile(ring_m, inscribed_radius_m, decay_per_m)
    for window, cost in cost_windows(costmap.shape, origin, resolution, constraints, profile):
        paint(costmap[window], cost)
    return costmap


class CostmapPainter:
    """Paints people into one costmap and restores the cells when they move on.

    Each update removes the people of the last one and paints the new ones, as
    :func:`paint_costmap` does. A cell that other code has written since keeps its new value. Only a
    changed value is noticed: if other code writes the cost that is there already, the cell later
    gets back its value from before the person came. So write a static layer that changes between
    :meth:`clear` and :meth:`update`.

    Args:
        costmap: (H, W) uint8, writable; row = y, column = x. It is changed in place.
        origin_odom_m: (2,) lower-left corner of cell (0, 0).
        resolution_m: side of a cell, > 0.
        ring_m: ≥ 0, from the obstacle's edge (Nav2's ``inflation_radius``).
        decay_per_m: > 0 (Nav2's ``cost_scaling_factor``).
        inscribed_radius_m: ≥ 0, of the robot's footprint.

    Raises:
        NavError: for an array of another type, shape or dtype, or a number out of bounds.
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
        self._profile = checked_profile(ring_m, inscribed_radius_m, decay_per_m)
        # Windows in the order of painting, with their cells before and after it.
        self._painted: list[tuple[tuple[slice, slice], Cells, Cells]] = []

    @property
    def costmap(self) -> NDArray[np.uint8]:
        """(H, W) array that is painted into."""
        return self._costmap

    def update(self, constraints: NavConstraints) -> tuple[tuple[slice, slice], ...]:
        """Replace the people of the last update with these.

        Returns:
            Windows (rows, columns) with every changed cell: of the last people, then of these.
        """
        cleared = self.clear()
        shape = self._costmap.shape
        for window, cost in cost_windows(
            (shape[0], shape[1]), self._origin, self._resolution, constraints, self._profile
        ):
            cells = self._costmap[window]
            before = cells.copy()
            paint(cells, cost)
            self._painted.append((window, before, cells.copy()))
        return (*cleared, *(window for window, _, _ in self._painted))

    def clear(self) -> tuple[tuple[slice, slice], ...]:
        """Remove all people and return the windows (rows, columns) in which they were."""
        windows = []
        # In reverse order: if windows overlap, the first one has the cells without people.
        while self._painted:
            window, before, after = self._painted.pop()
            cells = self._costmap[window]
            np.copyto(cells, before, where=cells == after)
            windows.append(window)
        return tuple(windows)

    def move(self, origin_odom_m: Any) -> None:
        """Set the new origin of a rolling map. Call :meth:`clear` before its cells are shifted.

        Raises:
            NavError: for an origin that is not finite, or while people are painted.
        """
        origin, _ = checked_grid(origin_odom_m, self._resolution)
        if self._painted:
            raise NavError("the costmap must be cleared before it moves, got one with people")
        self._origin = origin
