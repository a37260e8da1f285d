"""LaserScan and OccupancyGrid messages as scans and maps of :mod:`perception.laser`."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from perception import PerceptionError
from perception.arrays import finite_number
from perception.laser import LaserScan, MapCells

from .._errors import NavError
from .conversions import pose_matrix
from .messages.nav_msgs import OccupancyGrid

# No scanner has more rays.
_MAX_RAYS: Final = 20_000
# The last angle may be given as that of the ray after the last one, and is rounded by drivers.
_ANGLE_SLACK_RAD: Final = math.radians(1.0)
# map_server's default threshold of occupied cells, in per cent; larger numbers are unknown ones.
_OCCUPIED: Final = (65, 100)


def laser_scan_of(message: Any) -> LaserScan:
    """Return the scan of a message.

    Args:
        message: ``sensor_msgs`` LaserScan, of this package or of another library.

    Raises:
        NavError: for a scan without rays, angles or limits that are wrong, or that disagree.
    """
    count = len(message.ranges)
    if count > _MAX_RAYS:
        raise NavError(f"a scan must have at most {_MAX_RAYS} rays, got {count}")
    stamp = message.header.stamp
    try:
        scan = LaserScan(
            stamp.sec + 1e-9 * stamp.nanosec,
            message.angle_min,
            message.angle_increment,
            message.ranges,
            message.range_min,
            message.range_max,
            message.time_increment,
            message.intensities if len(message.intensities) else None,
        )
        last = finite_number("angle_max", message.angle_max)
    except PerceptionError as problem:
        raise NavError(str(problem)) from problem
    given = float(scan.angle_min_rad + scan.angle_increment_rad * (count - 1))
    if abs(given - last) > 2.0 * abs(scan.angle_increment_rad) + _ANGLE_SLACK_RAD:
        raise NavError(
            f"angle_max must be the angle of the last ray, {given:.4f} rad for {count} rays, got "
            f"{last:.4f} rad"
        )
    return scan


def map_cells_of(message: OccupancyGrid) -> MapCells:
    """Return the cells of a map that are occupied by 65 per cent or more.

    Raises:
        NavError: for a map whose size disagrees with its data, or has no sensible resolution.
    """
    info = message.info
    if info.width * info.height != len(message.data) or not message.data:
        raise NavError(
            f"a map must have width × height cells, got {info.width} × {info.height} and "
            f"{len(message.data)} cells"
        )
    side_m = float(info.resolution)
    # Written so that NaN is refused.
    if not 0.005 <= side_m <= 1.0:
        raise NavError(f"a map's resolution must be 0.005 to 1 m, got {side_m:g} m")
    place, turn = info.origin.position, info.origin.orientation
    T = pose_matrix((place.x, place.y, place.z), turn)
    data = np.frombuffer(message.data, np.int8).reshape(info.height, info.width)
    row, column = np.nonzero((data >= _OCCUPIED[0]) & (data <= _OCCUPIED[1]))
    cells = (np.column_stack((column, row)) + 0.5) * side_m
    return MapCells(cells @ T[:2, :2].T + T[:2, 3], side_m, message.header.frame_id)
