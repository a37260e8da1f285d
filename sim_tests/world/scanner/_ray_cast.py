"""Rays of a sweep cast against segments in the scan plane, in closed form on whole arrays.

A ray of a 2-D scanner meets a triangle exactly where it meets the segment in which the scan plane
cuts the triangle. The plane cuts few triangles, and a segment is met only by the rays within its
angle, so a sweep needs far fewer tests than one search per ray.
"""

from __future__ import annotations

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
    segments_m, origins_m = segments_m - centre, origins_m - centre
    first, last, turn = _rays_within(
        segments_m, angle_min_rad, angle_increment_rad, origins_m, turns_rad
    )
    segment, ray = _pairs(first, last, count, turn)
    x, y = np.ascontiguousarray(segments_m[:, 0].T)
    along_x, along_y = np.ascontiguousarray((segments_m[:, 1] - segments_m[:, 0]).T)
    moment = x * along_y - y * along_x
    angles = angle_min_rad + angle_increment_rad * np.arange(count) + turns_rad
    cos, sin = np.cos(angles), np.sin(angles)
    origin_x, origin_y = np.ascontiguousarray(origins_m.T)
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


def _rays_within(
    segments_m: FloatArray,
    angle_min_rad: float,
    increment_rad: float,
    origins_m: FloatArray,
    turns_rad: FloatArray,
) -> tuple[NDArray[np.int64], NDArray[np.int64], float]:
    """Return the first and last ray that may meet each segment, and the rays in a full turn.

    Rays count on beyond the sweep: a ray k and k plus a full turn are the same direction.
    """
    ends = np.arctan2(segments_m[..., 1], segments_m[..., 0])
    width = (ends[:, 1] - ends[:, 0] + np.pi) % (2.0 * np.pi) - np.pi
    low = np.where(width >= 0.0, ends[:, 0], ends[:, 1])
    width = np.abs(width)
    # Rays start beside the middle and are turned, so a segment is met by some rays beyond its ends.
    aside = float(np.sqrt((origins_m * origins_m).sum(axis=1).max()))
    along = segments_m[:, 1] - segments_m[:, 0]
    squares = np.maximum((along * along).sum(axis=1), 1e-18)
    share = np.clip(-(segments_m[:, 0] * along).sum(axis=1) / squares, 0.0, 1.0)
    near = np.linalg.norm(segments_m[:, 0] + share[:, None] * along, axis=1)
    ratio = np.clip(aside / np.maximum(near, 1e-12), 0.0, 1.0)
    slack = np.arcsin(ratio) + float(np.abs(turns_rad).max(initial=0.0))
    anywhere = near <= aside + _AT_ORIGIN_M
    low = np.where(anywhere, -np.pi, low - slack)
    width = np.where(anywhere, 2.0 * np.pi, np.minimum(width + 2.0 * slack, 2.0 * np.pi))
    turn = 2.0 * np.pi / abs(increment_rad)
    begin = low if increment_rad > 0.0 else low + width
    first = ((begin - angle_min_rad) / increment_rad) % turn
    rays = width / abs(increment_rad)
    return (
        np.ceil(first - 1e-6).astype(np.int64),
        np.floor(first + rays + 1e-6).astype(np.int64),
        turn,
    )


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
