"""LaserScan and OccupancyGrid messages as scans and maps of :mod:`perception.laser`."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from perception import PerceptionError
from perception.arrays import FloatArray, finite_number
from perception.laser import LaserScan, MapCells

from .._errors import NavError
from ._clock import CLOCK_TOLERANCE_S
from .conversions import pose_matrix
from .messages.nav_msgs import OccupancyGrid

# No scanner has more rays.
_MAX_RAYS: Final = 20_000
# angle_max may be rounded or be that of a ray beside the last one, and rays may be lost. With rays
# too many, a sweep may be longer than a full turn by the same share.
_ANGLE_SLACK_RAD: Final = math.radians(1.0)
_ANGLE_SLACK_SHARE: Final = 0.03
# No 2-D scanner measures farther. The limit of a driver without one is infinite.
_FARTHEST_M: Final = 250.0
# A sweep is no longer than the time between scans.
_SWEEP_SHARE: Final = 1.5
# So many scans show how often they come. Two scanners may share a topic.
_SCANS: Final = 5
_SWEEPS_AT_ONCE: Final = 2.5
# A scanner is stamped at the end of its sweeps if that many of so many scans come before they end
# by their stamps: all do then, but for those that are delayed, and of others only those of a clock
# that is being set.
_ARRIVALS: Final = 20
_EARLY_SHARE: Final = 0.25
# No scanner that is used on a robot sweeps more slowly.
_LONGEST_SWEEP_S: Final = 2.0
# Ranges beyond the limit with fewer values are codes of a driver, not distances.
_VALUES: Final = 4
# So much longer than the limit are ranges in a smaller unit.
_UNIT: Final = 10.0
# No scanner is blind up to here, and one without a limit of range meets something nearer than the
# second: in centimetres this is a hand's breadth.
_NEAREST_M: Final = 5.0
_NEAR_M: Final = 20.0
_NEAR_SHARE: Final = 0.1
# map_server's default threshold of occupied cells, in per cent; larger numbers are unknown ones.
_OCCUPIED: Final = (65, 100)


class ScanMessages:
    """Reads the messages of one scanner, and says once what is put right in them.

    Args:
        name: of the scanner.
        warn: called with each correction, once.
    """

    def __init__(self, name: str, warn: Callable[[str], object]) -> None:
        self._name, self._warn = name, warn
        self._came_early: deque[bool] = deque(maxlen=_ARRIVALS)
        self._stamps_s: deque[float] = deque(maxlen=_SCANS)
        self._said: set[str] = set()

    def read(self, message: Any, now_s: float) -> LaserScan:
        """Return the scan of a message that came at ``now_s``.

        A scanner whose sweeps end after their messages have come is stamped at the end of the
        sweep, and its scans are read so while at least a quarter of the last ones came so early.

        Raises:
            NavError: as :func:`laser_scan_of`, for sweeps that would go on while others begin, and
                for a sweep that ends in the future because time_increment and scan_time disagree.
        """
        scan = laser_scan_of(message)
        if message.time_increment < 0.0:
            self._say("time_increment", "time_increment is negative: the last ray is the oldest")
        sweep_s = scan.end_s - scan.stamp_s
        self._stamps_s.append(scan.stamp_s)
        every_s = (self._stamps_s[-1] - self._stamps_s[0]) / (_SCANS - 1)
        if len(self._stamps_s) == _SCANS and 0.0 < _SWEEPS_AT_ONCE * every_s < sweep_s:
            raise NavError(
                f"time_increment × rays is {sweep_s:.3f} s, but scans come every {every_s:.3f} s"
            )
        if scan.stamp_s <= (latest_s := now_s + CLOCK_TOLERANCE_S):
            self._came_early.append(scan.end_s > latest_s)
        share = sum(self._came_early) / max(len(self._came_early), 1)
        if share < _EARLY_SHARE:
            return scan
        if scan.end_s > latest_s and 0.0 < _SWEEP_SHARE * message.scan_time < sweep_s:
            raise NavError(
                f"time_increment × rays is {sweep_s:.3f} s, but scan_time "
                f"{message.scan_time:.3f} s: the last ray would be {scan.end_s - now_s:.3f} s "
                "ahead of this computer's clock"
            )
        self._say(
            "stamp",
            f"the sweep ends {scan.end_s - now_s:.3f} s after its message came "
            f"(time_increment × rays is {sweep_s:.3f} s): the stamp is taken for that of the "
            "last ray, while scans come so early",
        )
        return replace(scan, stamp_s=scan.stamp_s - sweep_s)

    def _say(self, what: str, text: str) -> None:
        if what not in self._said:
            self._said.add(what)
            self._warn(f"{self._name}: {text}")


def laser_scan_of(message: Any) -> LaserScan:
    """Return the scan of a message.

    Ray i is at angle_min + i · angle_increment; angle_max is only compared. Rays beyond a full turn
    count as those of the same direction, of which the nearer range is kept. A range_max above 250 m
    is 250 m. A negative time_increment
    means that the last ray is the oldest; the scan is returned in the order of time.

    Args:
        message: ``sensor_msgs`` LaserScan, of this package or of another library.

    Raises:
        NavError: for a scan without rays, angles or limits that are wrong, or that disagree, a
            sweep of more than 2 s, or ranges that are not in metres.
    """
    count = len(message.ranges)
    if count > _MAX_RAYS:
        raise NavError(f"a scan must have at most {_MAX_RAYS} rays, got {count}")
    stamp = message.header.stamp
    try:
        first = finite_number("angle_min_rad", message.angle_min)
        last = finite_number("angle_max", message.angle_max)
        increment = finite_number("angle_increment_rad", message.angle_increment)
        ray_s = finite_number("time_increment_s", message.time_increment)
        stamp_s = stamp.sec + 1e-9 * stamp.nanosec
        ranges = np.asarray(message.ranges, dtype=np.float64)
        if ray_s < 0.0:
            first, increment = first + increment * (count - 1), -increment
            stamp_s += ray_s * (count - 1)
            ranges = ranges[::-1]
        ranges = _one_turn(ranges, increment)
        scan = LaserScan(
            stamp_s,
            first,
            increment,
            ranges,
            message.range_min,
            min(message.range_max, _FARTHEST_M),
            abs(ray_s),
        )
    except (PerceptionError, TypeError, ValueError) as problem:
        raise NavError(str(problem)) from problem
    _check_angles(message.angle_min, message.angle_increment, count, last)
    sweep_s = scan.end_s - scan.stamp_s
    if sweep_s > _LONGEST_SWEEP_S:
        raise NavError(
            f"time_increment must be the seconds from ray to ray: {count} rays of {ray_s:g} s make "
            f"a sweep of {sweep_s:g} s, and scan_time says {message.scan_time:g} s"
        )
    _check_ranges(scan)
    _check_limits(scan)
    return scan


def _check_angles(first_rad: float, increment_rad: float, count: int, angle_max_rad: float) -> None:
    """Refuse an angle_max that says that the rays are elsewhere."""
    turn = increment_rad * (count - 1)
    slack = max(2.0 * abs(increment_rad) + _ANGLE_SLACK_RAD, _ANGLE_SLACK_SHARE * abs(turn))
    off = first_rad + turn - angle_max_rad
    if abs(off) <= slack or angle_max_rad == 0.0:
        return  # drivers that do not set it leave 0
    # It may be given within ±π, but not where the rays could as well turn the other way.
    backwards = abs(first_rad - turn - angle_max_rad) <= slack
    if abs(math.remainder(off, math.tau)) > slack or backwards:
        raise NavError(
            "angle_max must be the angle of the last ray, angle_min + (rays − 1) · "
            f"angle_increment, {first_rad + turn:.4f} rad for {count} rays, got "
            f"{angle_max_rad:.4f} rad"
        )


def _one_turn(ranges_m: FloatArray, increment_rad: float) -> FloatArray:
    """Return the ranges of a full turn at most, of rays of one direction the nearer one."""
    turn = math.tau / max(abs(increment_rad), 1e-9)
    kept = math.floor(turn + 1e-3) + 1
    extra = len(ranges_m) - kept
    if extra <= 0 or extra > _ANGLE_SLACK_SHARE * turn:
        return ranges_m
    first = kept - round(turn)
    nearer = ranges_m[:kept].copy()
    nearer[first : first + extra] = np.fmin(nearer[first : first + extra], ranges_m[kept:])
    return np.asarray(nearer)


def _check_ranges(scan: LaserScan) -> None:
    """Refuse ranges that cannot be metres."""
    beyond = scan.ranges_m[(scan.ranges_m > scan.range_max_m) & (scan.ranges_m < np.inf)]
    within = int(np.count_nonzero(scan.measured))
    values = np.unique(beyond)
    if len(values) < _VALUES or len(beyond) <= within:
        return
    middle_m = float(np.median(values))
    if middle_m <= _FARTHEST_M and (
        within or (2 * len(beyond) <= len(scan) and middle_m <= _UNIT * scan.range_max_m)
    ):
        return
    raise NavError(
        f"ranges must be in metres: {within or 'no'} rays measure anything within range_min "
        f"{scan.range_min_m:g} to range_max {scan.range_max_m:g} m, most are about {middle_m:g}"
    )


def _check_limits(scan: LaserScan) -> None:
    """Refuse limits that cannot be metres, and ranges whose limits do not vouch for the unit."""
    if scan.range_min_m > _NEAREST_M:
        raise NavError(f"range_min must be in metres, got {scan.range_min_m:g} m")
    met_m = scan.ranges_m[(scan.ranges_m > 0.0) & (scan.ranges_m < np.inf)]
    most_m = met_m.max(initial=0.0)
    if np.count_nonzero(met_m == most_m) >= _VALUES:  # a code for no return
        met_m = met_m[met_m < most_m]
    near = int(np.count_nonzero(met_m <= _NEAR_M))
    if (
        scan.range_max_m >= _FARTHEST_M
        and 2 * len(met_m) > len(scan)
        and near < _NEAR_SHARE * len(met_m)
    ):
        raise NavError(
            f"ranges must be in metres: {near or 'no'} of {len(met_m)} are below {_NEAR_M:g} m, "
            f"most are about {float(np.median(met_m)):g}, and range_max sets no limit"
        )


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
    T = pose_matrix(info.origin.position, info.origin.orientation)
    data = np.frombuffer(message.data, np.int8).reshape(info.height, info.width)
    row, column = np.nonzero((data >= _OCCUPIED[0]) & (data <= _OCCUPIED[1]))
    cells = (np.column_stack((column, row)) + 0.5) * side_m
    return MapCells(cells @ T[:2, :2].T + T[:2, 3], side_m, message.header.frame_id)
