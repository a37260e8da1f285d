"""Rays of a sweep cast against segments in the scan plane, in closed form on whole arrays.

A ray of a 2-D scanner meets a triangle exactly where it meets the segment in which the scan plane
cuts the triangle. The plane cuts few triangles, and a segment is met only by the rays within its
angle, so a sweep needs far fewer tests than one search per ray.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

# Tolerance on the share of a segment at which it is met, against seams between neighbours.
_SEAM: Final = 1e-9
# A segment nearer than this may be met by any ray.
_AT_ORIGIN_M: Final = 1e-3


class RayHits(NamedTuple):
    """The first hit of each of N rays.

    Attributes:
        ranges_m: (N,) distance; inf where a ray meets nothing.
        segments: (N,) row of the segment; −1 where a ray meets nothing.
    """

    ranges_m: FloatArray
    segments: NDArray[np.int64]


def cast_rays(
    segments_m: FloatArray,
    angle_min_rad: float,
    angle_increment_rad: float,
    origins_m: FloatArray,
    turns_rad: FloatArray,
) -> RayHits:
    """Return what the rays of one sweep meet first.

    Args:
        segments_m: (S, 2, 2) in the scan plane.
        angle_min_rad: angle of the first ray from x, before its turn.
        angle_increment_rad: angle between rays, not 0.
        origins_m: (N, 2) start of every ray; near to each other, as in one sweep of a robot.
        turns_rad: (N,) turn of the scanner at every ray, small.
    """
    count = len(origins_m)
    ranges, hits = np.full(count, np.inf), np.full(count, -1, dtype=np.int64)
    if not len(segments_m):
        return RayHits(ranges, hits)
    centre = 0.5 * (origins_m.min(axis=0) + origins_m.max(axis=0))
    x, y, end_x, end_y = np.ascontiguousarray((segments_m - centre).reshape(-1, 4).T)
    origin_x, origin_y = np.ascontiguousarray((origins_m - centre).T)
    along_x, along_y = end_x - x, end_y - y
    # Rays start beside the middle and are turned, so a segment is met by some rays beyond its ends.
    aside_m = math.sqrt(float((origin_x * origin_x + origin_y * origin_y).max()))
    near_m = _distances(x, y, along_x, along_y)
    slack = np.arcsin(np.minimum(aside_m / np.maximum(near_m, 1e-12), 1.0))
    slack += float(np.abs(turns_rad).max(initial=0.0))
    slack[near_m <= aside_m + _AT_ORIGIN_M] = np.pi
    ends = np.arctan2(y, x), np.arctan2(end_y, end_x)
    turn = 2.0 * np.pi / abs(angle_increment_rad)
    segment, ray = _pairs(
        *_rays_within(*ends, slack, angle_min_rad, angle_increment_rad), count, turn
    )
    moment = x * along_y - y * along_x
    angles = angle_min_rad + angle_increment_rad * np.arange(count) + turns_rad
    cos, sin = np.cos(angles), np.sin(angles)
    aside = origin_x * sin - origin_y * cos
    # For every pair: the ray's direction across the segment, the distance along the ray, and the
    # share of the segment at which it is met.
    along_x, along_y = along_x[segment], along_y[segment]
    cos, sin = cos[ray], sin[ray]
    across = cos * along_y - sin * along_x
    across[across == 0.0] = np.nan  # a parallel ray meets nothing
    share = (x[segment] * sin - y[segment] * cos - aside[ray]) / across
    distance = (moment[segment] - (origin_x[ray] * along_y - origin_y[ray] * along_x)) / across
    met = np.flatnonzero((distance > 0.0) & (np.abs(share - 0.5) <= 0.5 + _SEAM))
    ray, distance = ray[met], distance[met]
    np.minimum.at(ranges, ray, distance)
    nearest = np.flatnonzero(distance == ranges[ray])
    hits[ray[nearest]] = segment[met[nearest]]
    return RayHits(ranges, hits)


def _distances(
    x: FloatArray, y: FloatArray, along_x: FloatArray, along_y: FloatArray
) -> FloatArray:
    """Return the distance (S,) from 0 to segments that start at x, y."""
    squares = np.maximum(along_x * along_x + along_y * along_y, 1e-18)
    share = np.minimum(np.maximum(-(x * along_x + y * along_y) / squares, 0.0), 1.0)
    near_x, near_y = x + share * along_x, y + share * along_y
    return np.sqrt(near_x * near_x + near_y * near_y)


def _rays_within(
    start_rad: FloatArray,
    end_rad: FloatArray,
    slack_rad: FloatArray,
    angle_min_rad: float,
    increment_rad: float,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first and last ray that may meet each segment between two angles.

    Rays count on beyond the sweep: a ray k and k plus a full turn are the same direction.
    """
    width = (end_rad - start_rad + np.pi) % (2.0 * np.pi) - np.pi
    low = np.where(width >= 0.0, start_rad, end_rad) - slack_rad
    width = np.minimum(np.abs(width) + 2.0 * slack_rad, 2.0 * np.pi)
    begin = low if increment_rad > 0.0 else low + width
    first = ((begin - angle_min_rad) / increment_rad) % (2.0 * np.pi / abs(increment_rad))
    last = first + width / abs(increment_rad)
    return np.ceil(first - 1e-6).astype(np.int64), np.floor(last + 1e-6).astype(np.int64)


def _pairs(
    first: NDArray[np.int64], last: NDArray[np.int64], count: int, turn: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return segment and ray of every pair that may meet; rays wrap at a full turn."""
    begins, ends = [first], [last]
    # What ends beyond a full turn begins again, one ray early for turns that are no whole number.
    wraps = np.flatnonzero(last >= turn - 1.0)
    begins.append(np.zeros(len(wraps), dtype=np.int64))
    ends.append(np.ceil(last[wraps] - turn).astype(np.int64))
    rows = np.concatenate([np.arange(len(first)), wraps])
    begin = np.concatenate(begins)
    end = np.minimum(np.concatenate(ends), count - 1)
    counts = np.maximum(end - begin + 1, 0)
    segment = np.repeat(rows, counts)
    skipped = begin - np.cumsum(counts) + counts
    return segment, np.arange(len(segment)) + np.repeat(skipped, counts)
