"""Obstacles painted into a costmap with the cost values of Nav2."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._constraints import NavConstraints
from ._person_costs import (
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
