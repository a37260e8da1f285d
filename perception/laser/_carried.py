"""Things that a robot carries: what keeps its place in the base frame while the robot moves."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from ._points import RobotMotion, ScanPoints
from ._scan import LaserScan

# A return keeps its place if its ray keeps its range so well, also while the robot moves so far. A
# foot that stands moves by all of that, and no leg that walks along stays within it.
_KEEPS_M: Final = 0.04
_MOVED_M: Final = 0.25
# What is carried was there when the robot stood: it was slower than this. Somebody who drives along
# later, at the same speed, is never the robot's own.
_STANDS_MPS: Final = 0.05
# So many scans must show it.
_FEWEST_SCANS: Final = 4
# It stands apart from what is behind it, is no larger than a cart, and is no farther away.
_APART_M: Final = 0.3
_BROKEN_M: Final = 0.1
_WIDEST_M: Final = 1.6
_FARTHEST_M: Final = 3.0
# Wheels that slip move the odometry alone, and everybody who stands around keeps their place. The
# surroundings must show the motion: so many of the rays that are compared must meet at another
# range what stood at that place, and twice as many as still meet the same range.
_COMPARED: Final = 4
_SEEN_MOVING: Final = 8
_CHANGED_M: Final = 0.12
_SAME_PLACE_M: Final = 0.08
# A ray that does not meet the thing for so many scans tells that it is gone.
_GONE_SCANS: Final = 2
# Rays at the edge of a thing meet it now and then.
_EDGE_RAYS: Final = 2


class CarriedThings:
    """The returns of one scanner from what the robot carries or pulls, such as a cart's legs.

    They have kept their place on the robot, since it stood, while it moved by 0.25 m and the
    surroundings passed by. Nobody does that: of two feet that walk, one stands on the floor.
    """

    # By ray: the range that is kept, for how many scans, for how many it was not, and whether the
    # robot carries what is there.
    _range_m: FloatArray
    _scans: NDArray[np.int64]
    _missed: NDArray[np.int64]
    _own: NDArray[np.bool_]
    # The latest scan while the robot stood, and the robot's pose (4, 4) then.
    _stood: tuple[ScanPoints, FloatArray] | None

    def __init__(self) -> None:
        self._forget(0)

    def note(self, scan: LaserScan, points: ScanPoints, motion: RobotMotion) -> NDArray[np.bool_]:
        """Add a scan; return (N,) which of its rays met something that the robot carries.

        Args:
            scan: the scan, later than the one before.
            points: its points.
            motion: the robot's, with which they were made.
        """
        if len(scan) != self._rays:
            self._forget(len(scan))
        T_odom_base = motion.pose_at(points.stamp_s)
        ranges = np.where(points.usable, scan.ranges_m, np.nan)
        with np.errstate(invalid="ignore"):
            keeps = np.abs(ranges - self._range_m) <= _KEEPS_M
            beyond = (ranges > self._range_m + _KEEPS_M) | scan.no_return
        # What is carried may be hidden; what is not known to be must be met again and again.
        self._missed = np.where(keeps, 0, self._missed + np.where(self._own, beyond, True))
        gone = self._missed >= _GONE_SCANS
        self._own &= ~gone
        self._range_m[gone] = np.nan
        self._scans = np.where(gone, 0, self._scans + keeps)
        turning_mps = _FARTHEST_M * abs(motion.yaw_rate_radps)
        if math.hypot(*motion.velocity_base_mps.tolist()) + turning_mps <= _STANDS_MPS:
            new = points.usable & ~keeps & ~self._own
            self._range_m[new], self._scans[new], self._missed[new] = ranges[new], 1, 0
            self._stood = points, T_odom_base
        else:
            held = keeps & ~self._own & (self._scans >= _FEWEST_SCANS)
            if self._stood is not None and held.any():
                self._learn(held, ranges, points, T_odom_base, *self._stood)
        return self._with_edges(self._own & keeps, ranges)

    def places_base_m(self, points: ScanPoints, own: NDArray[np.bool_]) -> FloatArray:
        """Return (K, 2) the middles of the things that these rays met, in the base frame."""
        runs = np.split(own.nonzero()[0], (np.diff(own.nonzero()[0]) > 1).nonzero()[0] + 1)
        return np.array([points.points_base_m[run, :2].mean(axis=0) for run in runs if len(run)])

    def _forget(self, rays: int) -> None:
        self._rays = rays
        self._range_m = np.full(rays, np.nan)
        self._scans = np.zeros(rays, dtype=np.int64)
        self._missed = np.zeros(rays, dtype=np.int64)
        self._own = np.zeros(rays, dtype=bool)
        self._stood = None

    def _learn(
        self,
        held: NDArray[np.bool_],
        ranges: FloatArray,
        points: ScanPoints,
        T_odom_base: FloatArray,
        stood: ScanPoints,
        T_stood: FloatArray,
    ) -> None:
        """Find out which of the rays that keep their range met something that is carried."""
        step = np.linalg.inv(T_stood) @ T_odom_base
        found = []
        for run in _things(held, ranges, points):
            place = points.points_base_m[run].mean(axis=0)
            moved = step[:3, :3] @ place + step[:3, 3] - place
            near = math.hypot(*place[:2].tolist()) <= _FARTHEST_M
            if near and math.hypot(*moved[:2].tolist()) >= _MOVED_M:
                found.append(run)
        if found and _surroundings_pass(points, stood):
            self._own[np.concatenate(found)] = True

    def _with_edges(self, own: NDArray[np.bool_], ranges: FloatArray) -> NDArray[np.bool_]:
        wider = own.copy()
        if own.any():
            for shift in [*range(-_EDGE_RAYS, 0), *range(1, _EDGE_RAYS + 1)]:
                beside = np.where(np.roll(own, shift), np.roll(ranges, shift), np.nan)
                with np.errstate(invalid="ignore"):
                    wider |= np.abs(ranges - beside) <= _BROKEN_M
        return np.asarray(wider)


def _surroundings_pass(points: ScanPoints, stood: ScanPoints) -> bool:
    """Return whether a scan shows that the robot has moved as the odometry says."""
    rows = (points.usable & stood.usable).nonzero()[0][::_COMPARED]
    there = stood.points_odom_m[stood.usable, :2]
    now = points.points_odom_m[rows, :2]
    away = ((now[:, None] - there) ** 2).sum(axis=2).min(axis=1, initial=np.inf)
    same_place = away < _SAME_PLACE_M**2
    changed = np.abs(points.ranges_m[rows] - stood.ranges_m[rows])
    passing = int(np.count_nonzero(same_place & (changed > _CHANGED_M)))
    riding = int(np.count_nonzero(~same_place & (changed < _KEEPS_M)))
    return passing >= max(_SEEN_MOVING, 2 * riding)


def _things(
    held: NDArray[np.bool_], ranges: FloatArray, points: ScanPoints
) -> list[NDArray[np.int64]]:
    """Return the runs of held rays that are one thing each, apart from all behind it."""
    far = np.where(np.isnan(ranges), np.inf, ranges)
    rows = held.nonzero()[0]
    # A ray at the edge that is not held belongs to the thing as well.
    breaks = (np.diff(rows) > 1 + _EDGE_RAYS) | (np.abs(np.diff(ranges[rows])) > _BROKEN_M)
    things = []
    for run in np.split(rows, breaks.nonzero()[0] + 1):
        first, last = int(run[0]), int(run[-1])
        sides = far.take([first - 1 - _EDGE_RAYS, last + 1 + _EDGE_RAYS], mode="wrap")
        width_m = math.dist(*points.points_base_m[[first, last], :2].tolist())
        if (sides > ranges[[first, last]] + _APART_M).all() and width_m <= _WIDEST_M:
            things.append(run)
    return things
