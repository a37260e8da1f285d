"""Clusters of neighbouring scan points, divided where the distance to the next one jumps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray

#: Number of features of one cluster; see :func:`cluster_features`.
CLUSTER_FEATURES: Final = 11

# Distance of neighbours in one cluster: a constant, the noise of both ranges at 3σ, and the
# distance between rays where they meet a surface at an angle of 45°.
_JUMP_M: Final = 0.05
_JUMP_SIGMAS: Final = 3.0 * math.sqrt(2.0)
_JUMP_RAYS: Final = math.sqrt(2.0)
# Rays without a return that do not divide a cluster.
_MAX_LOST_RAYS: Final = 2
# Differences of range to the surfaces beside a cluster are limited to this.
_MAX_STEP_M: Final = 1.0
# Beside the field of view, and where rays return nothing, the surface counts as this far away.
_NOTHING_M: Final = 30.0


@dataclass(frozen=True, slots=True, eq=False)
class Clusters:
    """C clusters of M points, counter-clockwise as seen from the scanner.

    Attributes:
        points_m: (M, 2).
        ranges_m: (M,).
        rays: (M,) row of each point's ray in the scan.
        spacings_m: (M,) distance between rays at each point.
        steps_m: (2, M) range of the next surface to the right and to the left, minus the point's.
        starts: (C,) first point.
        counts: (C,) number of points.
        centres_m: (C, 2) mean of the points.
        spreads_m2: (3, C) xx, yy and xy of the covariance of the points.
        widths_m: (C,) distance from the first to the last point, plus one distance between rays.
        origin_m: (2,) place of the scanner.
        turn: 1 if the rays turn counter-clockwise, −1 otherwise.
    """

    points_m: FloatArray
    ranges_m: FloatArray
    rays: NDArray[np.int64]
    spacings_m: FloatArray
    steps_m: FloatArray
    starts: NDArray[np.int64]
    counts: NDArray[np.int64]
    centres_m: FloatArray
    spreads_m2: FloatArray
    widths_m: FloatArray
    origin_m: FloatArray
    turn: int

    @property
    def cluster(self) -> NDArray[np.int64]:
        """The cluster (M,) of every point."""
        return np.repeat(np.arange(len(self.starts)), self.counts)

    def sums(self, values: FloatArray) -> FloatArray:
        """Return the sums (C, …) of values (M, …) over the points of each cluster."""
        if not len(self.starts):
            return np.zeros((0, *values.shape[1:]))
        return np.asarray(np.add.reduceat(values, self.starts, axis=0))


def clusters_of(
    points_m: FloatArray,
    ranges_m: FloatArray,
    seen: NDArray[np.bool_],
    origin_m: FloatArray,
    increment_rad: float,
    noise_m: float,
    known: NDArray[np.int64] | None = None,
) -> Clusters:
    """Divide a scan into clusters.

    Args:
        points_m: (N, 2) in the order of the rays.
        ranges_m: (N,).
        seen: (N,) which rays are points.
        origin_m: (2,) place of the scanner.
        increment_rad: angle between rays.
        noise_m: standard deviation of a range.
        known: (N,) −1 for points of what is known to stand still, 1 for points of what has come, 0
            otherwise; a cluster is divided between the two, so that somebody beside a wall is
            apart. None for all 0.
    """
    rays = np.flatnonzero(seen)
    # All points are handled axis by axis, (2, M).
    away = np.take(points_m.T, rays, axis=1) - origin_m[:, None]
    ranges = ranges_m[rays]
    turn = 1
    if len(rays) > 1:
        turns = away[0, :-1] * away[1, 1:] - away[1, :-1] * away[0, 1:]
        if np.count_nonzero(turns < 0.0) > np.count_nonzero(turns > 0.0):
            rays, away, ranges, turn = rays[::-1], away[:, ::-1], ranges[::-1], -1
    # Where the first and the last ray are neighbours, the scan is cut open at its widest jump.
    if len(rays) > 1 and abs(increment_rad) * (len(points_m) + 1) >= 2.0 * math.pi:
        ahead = np.roll(away, -1, axis=1) - away
        shift = -(int((ahead * ahead).sum(axis=0).argmax()) + 1)
        rays, ranges = np.roll(rays, shift), np.roll(ranges, shift)
        away = np.roll(away, shift, axis=1)
    spacings = ranges * abs(increment_rad)
    between = np.abs(rays[1:] - rays[:-1])
    limit = np.minimum(between, _MAX_LOST_RAYS + 1) * np.maximum(spacings[:-1], spacings[1:])
    limit *= _JUMP_RAYS
    limit += _JUMP_M + _JUMP_SIGMAS * noise_m
    ahead = away[:, 1:] - away[:, :-1]
    ahead *= ahead
    first = np.ones(len(rays), dtype=bool)
    np.greater(ahead[0] + ahead[1], limit * limit, out=first[1:])
    if known is not None:
        kind = known[rays]
        first[1:] |= kind[:-1] * kind[1:] < 0
    steps = np.full((2, len(rays)), _NOTHING_M)
    if len(rays):
        # A ray without a return between two points is free space beside both.
        beside = np.where(between > _MAX_LOST_RAYS + 1, _NOTHING_M, 0.0)
        steps[0, 1:] = np.maximum(ranges[:-1], beside) - ranges[1:]
        steps[1, :-1] = np.maximum(ranges[1:], beside) - ranges[:-1]
    starts = np.flatnonzero(first)
    counts = np.diff(starts, append=len(rays))
    values = np.empty((5, len(rays)))
    values[:2] = away
    np.multiply(away, away, out=values[2:4])
    np.multiply(away[0], away[1], out=values[4])
    means = np.add.reduceat(values, starts, axis=1) if len(starts) else np.zeros((5, 0))
    means /= np.maximum(counts, 1)
    x, y = means[:2]
    means[2:] -= x * x, y * y, x * y
    across = away[:, starts + counts - 1] - away[:, starts]
    return Clusters(
        (away + origin_m[:, None]).T,
        ranges,
        rays,
        spacings,
        steps,
        starts,
        counts,
        (means[:2] + origin_m[:, None]).T,
        means[2:],
        np.sqrt((across * across).sum(axis=0)) + spacings[starts],
        np.asarray(origin_m, dtype=np.float64),
        turn,
    )


def cluster_features(clusters: Clusters) -> FloatArray:
    """Return (C, 11) features of each cluster, for the classifier.

    They are: logarithm of the number of points, range, width, larger and smaller standard deviation
    of the points, mean and standard deviation of the distance from the chord (towards the scanner
    positive), range step to the surface at the right and at the left (limited to 1 m), cosine
    between chord and ray, and the share of its rays that returned. Lengths are in decimetres but
    for the range (10 m) and the steps (m).
    """
    count = len(clusters.starts)
    if not count:
        return np.zeros((0, CLUSTER_FEATURES))
    starts, counts = clusters.starts, clusters.counts
    ends = starts + counts - 1
    points = clusters.points_m.T
    x, y = (clusters.centres_m - clusters.origin_m).T
    ranges = np.maximum(np.sqrt(x * x + y * y), 1e-6)
    ray_x, ray_y = x / ranges, y / ranges
    xx, yy, xy = clusters.spreads_m2
    middle, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    spread = np.sqrt(half * half + xy * xy)
    first = points[:, starts]
    chord_x, chord_y = points[:, ends] - first
    length = np.sqrt(chord_x * chord_x + chord_y * chord_y)
    # A cluster of one point has a chord across its ray.
    short = length <= 1e-6
    safe = np.maximum(length, 1e-6)
    unit_x = np.where(short, -ray_y, chord_x / safe)
    unit_y = np.where(short, ray_x, chord_y / safe)
    # Distances from the chord; away from the scanner is to its left.
    to_x, to_y = clusters.centres_m.T - first
    bulge = unit_x * to_y - unit_y * to_x
    depth = unit_y * unit_y * xx + unit_x * unit_x * yy - 2.0 * (unit_x * unit_y) * xy
    features = np.empty((CLUSTER_FEATURES, count))
    features[0] = np.log(counts)
    features[1] = 0.1 * ranges
    features[2] = 10.0 * clusters.widths_m
    features[3] = 10.0 * np.sqrt(np.maximum(middle + spread, 0.0))
    features[4] = 10.0 * np.sqrt(np.maximum(middle - spread, 0.0))
    features[5] = 10.0 * bulge
    features[6] = 10.0 * np.sqrt(np.maximum(depth, 0.0))
    features[7] = clusters.steps_m[0, starts]
    features[8] = clusters.steps_m[1, ends]
    np.minimum(features[7:9], _MAX_STEP_M, out=features[7:9])
    np.maximum(features[7:9], -_MAX_STEP_M, out=features[7:9])
    features[9] = unit_x * ray_x + unit_y * ray_y
    features[10] = counts / (np.abs(clusters.rays[ends] - clusters.rays[starts]) + 1.0)
    return np.asarray(features.T)
