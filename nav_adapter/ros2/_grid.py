"""People as an occupancy grid for a costmap's static layer."""

from __future__ import annotations

from typing import Any

import numpy as np

from perception.arrays import finite_array, finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from ..exporters import paint_costmap
from .conversions import header, to_time
from .messages.geometry_msgs import Point, Pose
from .messages.nav_msgs import MapMetaData, OccupancyGrid

_LARGEST_CELLS = 4_000_000
_OCCUPIED = 100


def occupancy_grid(
    constraints: NavConstraints,
    center_odom_m: Any,
    *,
    size_m: float = 10.0,
    resolution_m: float = 0.05,
    frame_id: str = "odom",
) -> OccupancyGrid:
    """Return ``nav_msgs/OccupancyGrid``: 100 inside the obstacles, 0 elsewhere.

    The grid is a square around ``center_odom_m``. Its corner is rounded to whole cells so that
    people do not smear when the grid moves. Costs around them are left to Nav2's inflation layer.

    Args:
        constraints: the people.
        center_odom_m: (2,), usually the robot.
        size_m: side of the square.
        resolution_m: side of a cell.
        frame_id: of the constraints.

    Raises:
        NavError: for numbers that are not finite or not positive, or over four million cells.
    """
    center = finite_array("center_odom_m", center_odom_m, (2,), NavError)
    size = finite_number("size_m", size_m, NavError, minimum=0.0, exclusive_minimum=True)
    cell = finite_number("resolution_m", resolution_m, NavError, minimum=1e-3)
    side = round(min(size / cell, 1e9))  # of a float, which may overflow
    if not 0 < side * side <= _LARGEST_CELLS:
        raise NavError(
            f"a grid must have 1 to {_LARGEST_CELLS} cells, got {side} x {side} "
            f"(size_m {size:g}, resolution_m {cell:g})"
        )
    origin = (np.floor(center / cell) - side // 2) * cell
    costs = np.zeros((side, side), dtype=np.uint8)
    paint_costmap(costs, origin, cell, constraints, ring_m=0.0)
    return OccupancyGrid(
        header(constraints.stamp_s, frame_id),
        MapMetaData(
            to_time(constraints.stamp_s),
            cell,
            side,
            side,
            Pose(Point(float(origin[0]), float(origin[1]), 0.0)),
        ),
        np.where(costs > 0, np.int8(_OCCUPIED), np.int8(0)).tobytes(),
    )
