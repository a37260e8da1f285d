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
    # Everything is computed axis by axis, about the middle of the origins.
    origins = origins_m.T
    centre = 0.5 * (origins.min(axis=1) + origins.max(axis=1))
    places = origins - centre[:, None]
    ends = np.array(segments_m.reshape(-1, 4).T, order="C")
    ends -= np.tile(centre, 2)[:, None]
    # Rays start beside the middle and are turned, so a segment is met by some rays beyond its ends.
    squares = places * places
    aside_m = math.sqrt(float((squares[0] + squares[1]).max()))
    turned_rad = max(float(turns_rad.max()), -float(turns_rad.min()))
    lines = np.empty((5, len(segments_m)))  # x, y, along x, along y, moment
    lines[:2] = ends[:2]
    np.subtract(ends[2:], ends[:2], out=lines[2:4])
    np.subtract(lines[0] * lines[3], lines[1] * lines[2], out=lines[4])
    near_m = _distances(lines)
    slack = np.maximum(near_m, 1e-12)
    np.divide(aside_m, slack, out=slack)
    np.minimum(slack, 1.0, out=slack)
    np.arcsin(slack, out=slack)
    slack += turned_rad
    slack[near_m <= aside_m + _AT_ORIGIN_M] = np.pi
    start_rad, end_rad = np.arctan2(ends[1::2], ends[::2])
    first, last = _rays_within(start_rad, end_rad, slack, angle_min_rad, angle_increment_rad)
    segment, ray = _pairs(first, last, count, 2.0 * np.pi / abs(angle_increment_rad))
    rays = np.empty((5, count))  # cosine, sine, origin x, origin y, moment
    angles = angle_min_rad + angle_increment_rad * np.arange(count)
    angles += turns_rad
    np.cos(angles, out=rays[0])
    np.sin(angles, out=rays[1])
    rays[2:4] = places
    np.subtract(places[0] * rays[1], places[1] * rays[0], out=rays[4])
    met, distance = _meetings(lines.take(segment, axis=1), rays.take(ray, axis=1))
    segment, ray = segment[met], ray[met]
    np.minimum.at(ranges, ray, distance)
    nearest = (distance == ranges[ray]).nonzero()[0]
    hits[ray[nearest]] = segment[nearest]
    return RayHits(ranges, hits)


def _meetings(lines: FloatArray, rays: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the pairs (M,) in which the ray meets the segment, and the distances (M,) along it.

    Args:
        lines: (5, P) x, y, along x, along y and moment of the segment of each pair.
        rays: (5, P) cosine, sine, origin x, origin y and moment of its ray.
    """
    x, y, along_x, along_y, moment = lines
    cos, sin, origin_x, origin_y, aside = rays
    # The ray's direction across the segment, the share of the segment at which it is met, and the
    # distance along the ray.
    across = cos * along_y
    across -= sin * along_x
    across[across == 0.0] = np.nan  # a parallel ray meets nothing
    share = x * sin
    share -= y * cos
    share -= aside
    share /= across
    distance = origin_x * along_y
    distance -= origin_y * along_x
    np.subtract(moment, distance, out=distance)
    distance /= across
    share -= 0.5
    np.abs(share, out=share)
    met = ((distance > 0.0) & (share <= 0.5 + _SEAM)).nonzero()[0]
    return met, distance[met]


def _distances(lines: FloatArray) -> FloatArray:
    """Return the distance (S,) from 0 to segments: rows x, y of the start, and along x, y."""
    x, y, along_x, along_y = lines[:4]
    squares = along_x * along_x
    squares += along_y * along_y
    np.maximum(squares, 1e-18, out=squares)
    share = x * along_x
    share += y * along_y
    share /= squares
    np.negative(share, out=share)
    np.maximum(share, 0.0, out=share)
    np.minimum(share, 1.0, out=share)
    near = share * lines[2:4]
    near += lines[:2]
    near *= near
    return np.asarray(np.sqrt(near[0] + near[1]))


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
    width = end_rad - start_rad
    width += np.pi
    width %= 2.0 * np.pi
    width -= np.pi
    begin = np.where(width >= 0.0, start_rad, end_rad)
    begin -= slack_rad
    np.abs(width, out=width)
    width += 2.0 * slack_rad
    np.minimum(width, 2.0 * np.pi, out=width)
    if increment_rad < 0.0:
        begin += width
    begin -= angle_min_rad
    begin /= increment_rad
    begin %= 2.0 * np.pi / abs(increment_rad)
    width /= abs(increment_rad)
    width += begin
    begin -= 1e-6
    width += 1e-6
    return np.ceil(begin).astype(np.int64), np.floor(width).astype(np.int64)


def _pairs(
    first: NDArray[np.int64], last: NDArray[np.int64], count: int, turn: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return segment and ray of every pair that may meet; rays wrap at a full turn."""
    # What ends beyond a full turn begins again, one ray early for turns that are no whole number.
    wraps = (last >= turn - 1.0).nonzero()[0]
    rows = np.concatenate([np.arange(len(first)), wraps])
    begin = np.concatenate([first, np.zeros(len(wraps), dtype=np.int64)])
    counts = np.concatenate([last, np.ceil(last[wraps] - turn).astype(np.int64)])
    np.minimum(counts, count - 1, out=counts)
    counts -= begin
    counts += 1
    np.maximum(counts, 0, out=counts)
    segment = rows.repeat(counts)
    begin -= counts.cumsum()
    begin += counts
    ray = np.arange(len(segment))
    ray += begin.repeat(counts)
    return segment, ray
