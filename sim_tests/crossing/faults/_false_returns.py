"""False returns in a scan: mirror images beyond shiny surfaces, and legs that do not exist."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray
from perception.laser import LaserScan

_MIRROR_WITHIN_M: Final = 8.0
_MIRROR_HALF_WIDTH_M: Final = 0.4
# A mirror's normal is at most so far from the direction to the scanner.
_MIRROR_TURN_RAD: Final = math.radians(45.0)
# A mirror is seen if nothing else returns from this much nearer.
_MIRROR_DEPTH_M: Final = 0.15
_LEG_RANGE_M: Final = (0.8, 6.0)
_LEG_RADIUS_M: Final = 0.06
_LEG_NOISE_M: Final = 0.015
_HALF_STANCE_M: Final = (0.06, 0.20)
_FASTEST_MPS: Final = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Mirror:
    """A mirror that stands in odom: its middle (2,) and its unit normal (2,)."""

    middle_odom_m: FloatArray
    normal_odom: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """Two legs in odom: their middle (2,) at a time, their velocity, and half their distance (2,).

    ``appears_s`` is the time of the place.
    """

    middle_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    half_odom_m: FloatArray
    appears_s: float


def new_mirror(
    rng: np.random.Generator, scan: LaserScan, T_odom_scanner: FloatArray
) -> Mirror | None:
    """Return a mirror at a surface of the scan, turned about it; None without a surface."""
    chance, turn = rng.random(2).tolist()
    rays = np.flatnonzero(scan.measured & (scan.ranges_m <= _MIRROR_WITHIN_M))
    if not rays.size:
        return None
    ray = int(rays[int(chance * rays.size)])
    angle = float(scan.angles_rad[ray])
    middle = scan.ranges_m[ray] * np.array([math.cos(angle), math.sin(angle)])
    back = angle + math.pi + (2.0 * turn - 1.0) * _MIRROR_TURN_RAD
    rotation, origin = T_odom_scanner[:2, :2], T_odom_scanner[:2, 3]
    return Mirror(origin + rotation @ middle, rotation @ np.array([math.cos(back), math.sin(back)]))


def new_legs(rng: np.random.Generator, t_s: float, origin_odom_m: FloatArray) -> Legs:
    """Return legs about the scanner's place (2,)."""
    distance, bearing, stands, pace, course, stance, side = rng.random(7).tolist()
    near_m, far_m = _LEG_RANGE_M
    bearing, course, side = (math.tau * each for each in (bearing, course, side))
    speed_mps = 0.0 if stands < 0.5 else pace * _FASTEST_MPS
    low_m, high_m = _HALF_STANCE_M
    return Legs(
        origin_odom_m + (near_m + distance * (far_m - near_m)) * _unit(bearing),
        speed_mps * _unit(course),
        (low_m + stance * (high_m - low_m)) * _unit(side),
        t_s,
    )


def with_mirror(scan: LaserScan, mirror: Mirror, T_odom_scanner: FloatArray) -> LaserScan:
    """Return the scan with the mirror images of its own points beyond a mirror."""
    rotation, origin = T_odom_scanner[:2, :2], T_odom_scanner[:2, 3]
    middle = rotation.T @ (mirror.middle_odom_m - origin)
    normal = rotation.T @ mirror.normal_odom
    if middle @ normal >= 0.0:  # the scanner is behind the mirror
        return scan
    measured = np.flatnonzero(scan.measured)
    angles, ranges = scan.angles_rad, scan.ranges_m.copy()
    points = ranges[measured, None] * np.column_stack(
        (np.cos(angles[measured]), np.sin(angles[measured]))
    )
    above = (points - middle) @ normal
    points, above = points[above > _MIRROR_DEPTH_M], above[above > _MIRROR_DEPTH_M]
    images = points - 2.0 * above[:, None] * normal
    # Where the line from the scanner to the image meets the mirror.
    share = (middle @ normal) / (images @ normal)
    on_mirror = share[:, None] * images
    beside = np.hypot(*(on_mirror - middle).T)
    rays, distances = _rays(scan, images)
    seen = (rays >= 0) & (beside <= _MIRROR_HALF_WIDTH_M) & (distances <= scan.range_max_m)
    seen[seen] &= ranges[rays[seen]] >= np.hypot(*on_mirror[seen].T) - _MIRROR_DEPTH_M
    nearest = np.full(len(ranges), np.inf)
    np.minimum.at(nearest, rays[seen], distances[seen])
    return replace(scan, ranges_m=np.where(np.isfinite(nearest), nearest, ranges))


def with_legs(
    scan: LaserScan, legs: Legs, t_s: float, T_odom_scanner: FloatArray, noise: FloatArray
) -> LaserScan:
    """Return the scan with the nearer surfaces of two legs; ``noise`` is (N,), standard normal."""
    rotation, origin = T_odom_scanner[:2, :2], T_odom_scanner[:2, 3]
    middle = legs.middle_odom_m + (t_s - legs.appears_s) * legs.velocity_odom_mps
    ranges, angles = scan.ranges_m.copy(), scan.angles_rad
    for side in (-1.0, 1.0):
        x, y = (rotation.T @ (middle + side * legs.half_odom_m - origin)).tolist()
        along = x * np.cos(angles) + y * np.sin(angles)
        beside = np.abs(y * np.cos(angles) - x * np.sin(angles))
        depth = np.sqrt(np.maximum(_LEG_RADIUS_M**2 - beside**2, 0.0))
        surface = along - depth + _LEG_NOISE_M * noise
        meets = (beside < _LEG_RADIUS_M) & (along > _LEG_RADIUS_M)
        meets &= (surface >= scan.range_min_m) & (surface <= scan.range_max_m)
        # Rays without a return become shorter as well; NaN and -inf stay.
        ranges = np.where(meets & (ranges > surface), surface, ranges)
    return replace(scan, ranges_m=ranges)


def _rays(scan: LaserScan, points: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the ray (N,) nearest to each point (N, 2), −1 for none, and the point's range (N,)."""
    angle = np.arctan2(points[:, 1], points[:, 0])
    step = scan.angle_increment_rad
    off = np.mod((angle - scan.angle_min_rad) * math.copysign(1.0, step), math.tau)
    rays = np.rint(off / abs(step)).astype(np.int64)
    return np.where(rays < len(scan), rays, -1), np.hypot(points[:, 0], points[:, 1])


def _unit(angle_rad: float) -> FloatArray:
    return np.array([math.cos(angle_rad), math.sin(angle_rad)])
