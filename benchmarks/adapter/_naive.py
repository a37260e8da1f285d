"""The costmap as a first version: shapely's distance of every cell to every polygon."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from nav_adapter import NavConstraints

from ._crowd import CELLS, ORIGIN_ODOM_M, RESOLUTION_M


def paint_naively(costmap: NDArray[np.uint8], constraints: NavConstraints) -> None:
    """Paint like :func:`nav_adapter.paint_costmap`, with polygons instead of circles."""
    x = ORIGIN_ODOM_M[0] + RESOLUTION_M * (np.arange(CELLS[1]) + 0.5)
    y = ORIGIN_ODOM_M[1] + RESOLUTION_M * (np.arange(CELLS[0]) + 0.5)
    cells = shapely.points(*np.meshgrid(x, y))
    for obstacle in constraints.obstacles:
        gap_m = shapely.distance(cells, obstacle.polygon)
        cost = np.where(gap_m <= 0.55, 252.0 * np.exp(-10.0 * gap_m), 0.0)
        np.maximum(costmap, cost.astype(np.uint8), out=costmap)
        costmap[gap_m == 0.0] = 254
