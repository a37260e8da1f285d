"""Points of a scan in the base and odom frames, corrected for the robot's motion in the scan."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray, finite_array, finite_number, rigid_transform, set_fields
from ..errors import PerceptionError
from ._scan import BODY_MARGIN_M, LaserScan, Scanner

# Below this turn an arc is computed as its series, which is exact to rounding.
_STRAIGHT_RAD: Final = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class RobotMotion:
    """The robot's pose at one instant and its velocity around it.

    Attributes:
        stamp_s: time of the pose.
        T_odom_base: (4, 4) pose of the base frame.
        velocity_base_mps: (2,) velocity of the base origin, in the base frame.
        yaw_rate_radps: turn about the base frame's z axis, counter-clockwise positive.

    Raises:
        PerceptionError: for values that are not finite, or a pose that is not rigid.
    """

    stamp_s: float
    T_odom_base: FloatArray
    velocity_base_mps: FloatArray = (0.0, 0.0)  # type: ignore[assignment]
    yaw_rate_radps: float = 0.0

    def __post_init__(self) -> None:
        set_fields(
            self,
            stamp_s=finite_number("stamp_s", self.stamp_s),
            T_odom_base=rigid_transform("T_odom_base", self.T_odom_base),
            velocity_base_mps=finite_array("velocity_base_mps", self.velocity_base_mps, (2,)),
            yaw_rate_radps=finite_number("yaw_rate_radps", self.yaw_rate_radps),
        )

    @classmethod
    def between(
        cls, start_s: float, T_odom_start: Any, end_s: float, T_odom_end: Any
    ) -> RobotMotion:
        """Return the motion of constant speed and yaw rate from one pose to another.

        Args:
            start_s: time of the first pose, for example of the first ray.
            T_odom_start: (4, 4) first pose of the base frame.
            end_s: later time.
            T_odom_end: (4, 4) pose at that time; less than half a turn away.

        Raises:
            PerceptionError: for times in the wrong order, or poses that are not rigid.
        """
        first = rigid_transform("T_odom_start", T_odom_start)
        step = np.linalg.inv(first) @ rigid_transform("T_odom_end", T_odom_end)
        start = finite_number("start_s", start_s)
        dt = finite_number("end_s", end_s) - start
        if dt <= 0.0:
            raise PerceptionError(f"end_s must be later than start_s, got {start:g} and {end_s:g}")
        yaw = math.atan2(step[1, 0], step[0, 0])
        # The inverse of the arc in poses_base().
        half = 0.5 * yaw
        along = half / math.tan(half) if abs(yaw) > _STRAIGHT_RAD else 1.0 - yaw * yaw / 12.0
        x, y = step[:2, 3].tolist()
        velocity = np.array([along * x + half * y, along * y - half * x]) / dt
        return cls(start, first, velocity, yaw / dt)

    def poses_base(self, stamps_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return yaw (N,) and position (N, 2) of the base frame at other times.

        Both are given in the base frame of :attr:`stamp_s`; the robot drives arcs of constant speed
        and yaw rate.
        """
        arc = self.arc(np.asarray(stamps_s, dtype=np.float64) - self.stamp_s)
        return arc.yaw_rad, np.column_stack((arc.x_m, arc.y_m))

    def pose_at(self, stamp_s: float) -> FloatArray:
        """Return T_odom_base (4, 4) at another time, for example that of a scan's middle."""
        yaw, position = self.poses_base(np.array([finite_number("stamp_s", stamp_s)]))
        cos, sin = math.cos(yaw[0]), math.sin(yaw[0])
        moved = np.eye(4)
        moved[:2, :2] = [[cos, -sin], [sin, cos]]
        moved[:2, 3] = position[0]
        return np.asarray(self.T_odom_base @ moved)

    def arc(self, dt_s: FloatArray) -> Arc:
        """Return the way of the base frame, in the base frame of :attr:`stamp_s`.

        Args:
            dt_s: (N,) times after :attr:`stamp_s`.
        """
        yaw = self.yaw_rate_radps * dt_s
        cos, sin = np.cos(yaw), np.sin(yaw)
        along, aside = 1.0 - yaw * yaw / 6.0, 0.5 * yaw
        turned = np.abs(yaw) >= _STRAIGHT_RAD
        if turned.any():
            np.divide(sin, yaw, out=along, where=turned)
            np.divide(1.0 - cos, yaw, out=aside, where=turned)
        x, y = self.velocity_base_mps.tolist()
        return Arc(yaw, cos, sin, (along * x - aside * y) * dt_s, (aside * x + along * y) * dt_s)


class Arc(NamedTuple):
    """Turns (N,) of the base frame with their cosines and sines, and its places (N,)."""

    yaw_rad: FloatArray
    cos: FloatArray
    sin: FloatArray
    x_m: FloatArray
    y_m: FloatArray

    def moved(
        self, x_m: FloatArray | float, y_m: FloatArray | float
    ) -> tuple[FloatArray, FloatArray]:
        """Return x and y (N,) of points, each turned and shifted by its own row."""
        return (
            self.cos * x_m - self.sin * y_m + self.x_m,
            self.sin * x_m + self.cos * y_m + self.y_m,
        )


@dataclass(frozen=True, slots=True, eq=False)
class ScanPoints:
    """The N rays of a scan as points; those that measured nothing usable are NaN.

    Attributes:
        stamp_s: time of the middle of the scan.
        points_base_m: (N, 3) where the base frame was at :attr:`RobotMotion.stamp_s`.
        points_odom_m: (N, 3).
        origins_odom_m: (N, 3) the scanner's place at the time of each ray.
        ends_odom_m: (N, 3) end of the stretch over which each ray met nothing; NaN where unknown.
        ranges_m: (N,) range of each point; NaN without.
        usable: (N,) whether the ray is a point: measured, in the field of view, not on the robot.
        angle_increment_rad: as the scan's.
    """

    stamp_s: float
    points_base_m: FloatArray
    points_odom_m: FloatArray
    origins_odom_m: FloatArray
    ends_odom_m: FloatArray
    ranges_m: FloatArray
    usable: NDArray[np.bool_]
    angle_increment_rad: float

    def without(self, own: NDArray[np.bool_]) -> ScanPoints:
        """Return the points without those of some rays (N,): they met the robot's own body."""
        return replace(
            self,
            points_base_m=np.where(own[:, None], np.nan, self.points_base_m),
            points_odom_m=np.where(own[:, None], np.nan, self.points_odom_m),
            ranges_m=np.where(own, np.nan, self.ranges_m),
            usable=self.usable & ~own,
        )


def scan_points(scan: LaserScan, scanner: Scanner, motion: RobotMotion) -> ScanPoints:
    """Return a scan's points in base and odom, each ray from where the robot was at its time.

    Args:
        scan: the scan.
        scanner: its mounting.
        motion: the robot's pose and velocity; a pose near the scan's own time is best.
    """
    beams = beams_of(scanner, scan)
    offset = scanner.T_base_scanner[:3, 3]
    free = scan.free_m
    known = beams.covered & (free > 0.0)
    measured = scan.measured & known
    # All points are computed axis by axis, (3, N).
    reach = beams.rays * np.where(known, free, np.nan)
    reach += offset[:, None]
    rows = (measured & (free <= beams.body_within_m)).nonzero()[0]
    if rows.size:
        points = reach[:2].take(rows, axis=1)
        near = (np.abs(points) <= beams.outermost_m).all(axis=0).nonzero()[0]
        if near.size:
            measured[rows[near][scanner.is_body(points[:, near].T)]] = False
    arc = motion.arc(scan.stamps_s - motion.stamp_s)
    origins = np.empty_like(reach)
    x, y, z = offset.tolist()
    origins[0], origins[1] = arc.moved(x, y)
    origins[2] = z
    reach[0], reach[1] = arc.moved(reach[0], reach[1])
    R, t = motion.T_odom_base[:3, :3], motion.T_odom_base[:3, 3:]
    ends_odom = R @ reach
    ends_odom += t
    origins_odom = R @ origins
    origins_odom += t
    points_odom = ends_odom.copy()
    unmeasured = ~measured
    np.copyto(points_odom, np.nan, where=unmeasured)
    np.copyto(reach, np.nan, where=unmeasured)
    np.putmask(free, unmeasured, np.nan)
    arrays = (reach.T, points_odom.T, origins_odom.T, ends_odom.T, free, measured)
    for array in arrays:
        array.setflags(write=False)
    middle_s = 0.5 * (scan.stamp_s + scan.end_s)
    return ScanPoints(middle_s, *arrays, angle_increment_rad=scan.angle_increment_rad)


class Beams(NamedTuple):
    """The rays of a mounted scanner.

    Attributes:
        rays: (3, N) directions in base.
        covered: (N,) which lie in the field of view.
        body_within_m: no return farther away is the robot's own body; −1 without an outline.
        outermost_m: no coordinate in base of a return from the robot's own body is larger.
    """

    rays: FloatArray
    covered: NDArray[np.bool_]
    body_within_m: float
    outermost_m: float


def beams_of(scanner: Scanner, scan: LaserScan) -> Beams:
    """Return the rays of a scan in the base frame."""
    return _beams(scanner, scan.angle_min_rad, scan.angle_increment_rad, len(scan))


@lru_cache(maxsize=16)  # the scanners of a robot, scan after scan
def _beams(scanner: Scanner, angle_min_rad: float, angle_increment_rad: float, count: int) -> Beams:
    angles = angle_min_rad + angle_increment_rad * np.arange(count, dtype=np.float64)
    rays = scanner.T_base_scanner[:3, :3] @ np.stack(
        (np.cos(angles), np.sin(angles), np.zeros(count))
    )
    within_m, outermost_m = -1.0, 0.0
    if scanner.body_base_m is not None:
        outermost_m = float(np.abs(scanner.body_base_m).max()) + BODY_MARGIN_M
        away = scanner.body_base_m - scanner.T_base_scanner[:2, 3]
        # A tilted ray is longer than its part in the plane of the outline.
        level = float(np.hypot(rays[0], rays[1]).min(initial=1.0))
        farthest = float(np.hypot(*away.T).max()) + BODY_MARGIN_M
        within_m = farthest / max(level, 1e-9) + BODY_MARGIN_M
    covered = scanner.covers(angles)
    covered.setflags(write=False)
    return Beams(rays, covered, within_m, outermost_m)
