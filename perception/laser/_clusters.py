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
        starts: (C,) first point.
        ends: (C,) last point.
        counts: (C,) number of points.
        steps_m: (2, C) range of the next surface to the right and to the left, minus that of the
            cluster's own end there.
        centres_m: (C, 2) mean of the points.
        spreads_m2: (3, C) xx, yy and xy of the covariance of the points.
        widths_m: (C,) distance from the first to the last point, plus one distance between rays.
        lengths_m: (C,) sum of the distances between rays.
        came: (C,) number of points of what has come.
        still: (C,) number of points of what is known to stand still.
        origin_m: (2,) place of the scanner.
        turn: 1 if the rays turn counter-clockwise, −1 otherwise.
    """

    points_m: FloatArray
    ranges_m: FloatArray
    rays: NDArray[np.int64]
    spacings_m: FloatArray
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    counts: NDArray[np.int64]
    steps_m: FloatArray
    centres_m: FloatArray
    spreads_m2: FloatArray
    widths_m: FloatArray
    lengths_m: FloatArray
    came: FloatArray
    still: FloatArray
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
    rays = seen.nonzero()[0]
    # All points are handled axis by axis, (2, M).
    away = points_m.T.take(rays, axis=1)
    away -= origin_m[:, None]
    ranges = ranges_m[rays]
    turn = 1
    if len(rays) > 1:
        turns = np.sign(away[0, :-1] * away[1, 1:] - away[1, :-1] * away[0, 1:])
        if np.add.reduce(turns) < 0.0:
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
    # Rows: places, their squares and product, spacings, whether they have come, stand still.
    values = np.zeros((8, len(rays)))
    if known is not None:
        kind = known[rays]
        first[1:] |= kind[:-1] * kind[1:] < 0
        np.greater(kind, 0, out=values[6])
        np.less(kind, 0, out=values[7])
    starts = first.nonzero()[0]
    counts = np.empty_like(starts)
    np.subtract(starts[1:], starts[:-1], out=counts[:-1])
    counts[-1:] = len(rays) - starts[-1:]
    ends = starts + counts - 1
    values[:2] = away
    np.multiply(away, away, out=values[2:4])
    np.multiply(away[0], away[1], out=values[4])
    values[5] = spacings
    sums = np.add.reduceat(values, starts, axis=1) if len(starts) else np.zeros((8, 0))
    means = sums[:5] / counts
    spreads = means[2:]
    spreads[:2] -= means[:2] * means[:2]
    spreads[2] -= means[0] * means[1]
    across = away.take(ends, axis=1) - away.take(starts, axis=1)
    across *= across
    return Clusters(
        (away + origin_m[:, None]).T,
        ranges,
        rays,
        spacings,
        starts,
        ends,
        counts,
        _steps(ranges, between, starts),
        (means[:2] + origin_m[:, None]).T,
        spreads,
        np.sqrt(across[0] + across[1]) + spacings[starts],
        sums[5],
        sums[6],
        sums[7],
        np.asarray(origin_m, dtype=np.float64),
        turn,
    )


def _steps(
    ranges_m: FloatArray, between: NDArray[np.int64], starts: NDArray[np.int64]
) -> FloatArray:
    """Return (2, C) the steps from the ends of clusters to the surfaces beside them.

    ``between`` (M − 1) counts the rays from every point to the next one.
    """
    steps = np.full((2, len(starts)), _NOTHING_M)
    left = starts[1:]
    # A ray without a return between two points is free space beside both.
    beside = np.where(between[left - 1] > _MAX_LOST_RAYS + 1, _NOTHING_M, 0.0)
    last, first = ranges_m[left - 1], ranges_m[left]
    steps[0, 1:] = np.maximum(last, beside) - first
    steps[1, :-1] = np.maximum(first, beside) - last
    return steps


def cluster_features(clusters: Clusters) -> FloatArray:
    """Return (11, C) features of each cluster, for the classifier.

    They are: logarithm of the number of points, range, width, larger and smaller standard deviation
    of the points, mean and standard deviation of the distance from the chord (towards the scanner
    positive), range step to the surface at the right and at the left (limited to 1 m), cosine
    between chord and ray, and the share of its rays that returned. Lengths are in decimetres but
    for the range (10 m) and the steps (m).
    """
    count = len(clusters.starts)
    starts, ends, counts = clusters.starts, clusters.ends, clusters.counts
    points, centres = clusters.points_m.T, clusters.centres_m.T
    # Pairs of coordinates are (2, C).
    away = centres - clusters.origin_m[:, None]
    squares = away * away
    ranges = np.maximum(np.sqrt(squares[0] + squares[1]), 1e-6)
    ray = away / ranges
    xx, yy, xy = clusters.spreads_m2
    middle, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    spread = np.sqrt(half * half + xy * xy)
    first = points.take(starts, axis=1)
    chord = points.take(ends, axis=1) - first
    squares = chord * chord
    length = np.sqrt(squares[0] + squares[1])
    unit = chord / np.maximum(length, 1e-6)
    # A cluster of one point has a chord across its ray.
    short = (length <= 1e-6).nonzero()[0]
    unit[0, short] = -ray[1, short]
    unit[1, short] = ray[0, short]
    unit_x, unit_y = unit
    # Distances from the chord; away from the scanner is to its left.
    to_x, to_y = centres - first
    features = np.empty((CLUSTER_FEATURES, count))
    np.log(counts, out=features[0])
    np.multiply(0.1, ranges, out=features[1])
    features[2] = clusters.widths_m
    features[5] = unit_x * to_y - unit_y * to_x
    # Variances; rounding may leave them below zero.
    np.add(middle, spread, out=features[3])
    np.subtract(middle, spread, out=features[4])
    squares = unit * unit
    features[6] = squares[1] * xx + squares[0] * yy - 2.0 * (unit_x * unit_y) * xy
    for rows in (features[3:5], features[6]):
        np.maximum(rows, 0.0, out=rows)
        np.sqrt(rows, out=rows)
    features[2:7] *= 10.0
    np.minimum(clusters.steps_m, _MAX_STEP_M, out=features[7:9])
    np.maximum(features[7:9], -_MAX_STEP_M, out=features[7:9])
    ray *= unit
    np.add(ray[0], ray[1], out=features[9])
    rays = clusters.rays
    np.divide(counts, np.abs(rays[ends] - rays[starts]) + 1.0, out=features[10])
    return features
