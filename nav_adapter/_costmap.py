"""Obstacles painted into an occupancy grid with the cost values of Nav2."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray, finite_array, finite_number

from ._constraints import NavConstraints, PersonObstacle
from ._errors import NavError

# nav2_costmap_2d/cost_values.hpp
_LETHAL: Final = 254
_RING_COST: Final = 252.0


def paint_costmap(
    costmap: NDArray[np.uint8],
    origin_odom_m: Any,
    resolution_m: float,
    constraints: NavConstraints,
    *,
    ring_m: float = 0.55,
    decay_per_m: float = 10.0,
) -> NDArray[np.uint8]:
    """Paint the obstacles into a costmap, in place.

    A cell whose centre lies within an obstacle's radius r becomes lethal (254), as does the cell
    that holds the obstacle's centre, so that no obstacle slips through a coarse grid. In a ring
    outside, at distance d from the obstacle's centre, the cost is ⌊252·exp(−k(d − r))⌋, as in
    Nav2's inflation layer, or what was there when that is more. Unknown cells (255) become
    lethal within the radius and stay unknown in the ring. Cells farther away are not touched.

    Args:
        costmap: (H, W) uint8, writable; row = y, column = x.
        origin_odom_m: (2,) lower-left corner of cell (0, 0), as in ``nav_msgs/OccupancyGrid``.
        resolution_m: side of a cell, > 0.
        constraints: the obstacles to paint.
        ring_m: width of the ring, ≥ 0 (Nav2's ``inflation_radius``).
        decay_per_m: k > 0 (Nav2's ``cost_scaling_factor``).

    Returns:
        The same array.

    Raises:
        NavError: an array of another type, shape or dtype, or a number out of bounds; the costmap
            is then untouched.
    """
    if not isinstance(costmap, np.ndarray) or costmap.dtype != np.uint8 or costmap.ndim != 2:
        given = (
            f"{costmap.dtype} of shape {costmap.shape}"
            if isinstance(costmap, np.ndarray)
            else type(costmap).__name__
        )
        raise NavError(f"costmap must be a uint8 array of shape (H, W), got {given}")
    if not costmap.flags.writeable:
        raise NavError("costmap must be writable, got a read-only array")
    origin = finite_array("origin_odom_m", origin_odom_m, (2,), NavError)
    resolution = finite_number(
        "resolution_m", resolution_m, NavError, minimum=0.0, exclusive_minimum=True
    )
    ring = finite_number("ring_m", ring_m, NavError, minimum=0.0)
    decay = finite_number("decay_per_m", decay_per_m, NavError, minimum=0.0, exclusive_minimum=True)
    for obstacle in constraints.obstacles:
        _paint(costmap, origin, resolution, obstacle, ring, decay)
    return costmap


def _paint(
    costmap: NDArray[np.uint8],
    origin: FloatArray,
    resolution: float,
    obstacle: PersonObstacle,
    ring: float,
    decay: float,
) -> None:
    center, radius = obstacle.center_odom_m - origin, obstacle.radius_m
    size = np.array(costmap.shape[::-1])
    reach = radius + ring
    # Clipped as floats: an obstacle far off the map must not overflow an integer.
    low = np.clip(np.floor((center - reach) / resolution), 0, size).astype(int)
    high = np.clip(np.ceil((center + reach) / resolution), 0, size).astype(int)
    if bool((low >= high).any()):
        return
    window = costmap[low[1] : high[1], low[0] : high[0]]
    columns, rows = np.arange(low[0], high[0]), np.arange(low[1], high[1])
    dx = (columns + 0.5) * resolution - center[0]
    dy = (rows + 0.5) * resolution - center[1]
    distance = np.hypot(dx, dy[:, None])

    cost = np.floor(_RING_COST * np.exp(-decay * np.maximum(distance - radius, 0.0)))
    cost[distance > reach] = 0.0
    # 255 (no information) is above every cost, so the maximum also keeps unknown cells unknown.
    np.maximum(window, cost.astype(np.uint8), out=window)
    window[distance <= radius] = _LETHAL
    cell = np.floor(center / resolution)
    window[np.ix_(rows == cell[1], columns == cell[0])] = _LETHAL
