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
    points, ranges = points_m[rays], ranges_m[rays]
    away = points - origin_m
    turn = 1
    if len(rays) > 1:
        turns = away[:-1, 0] * away[1:, 1] - away[:-1, 1] * away[1:, 0]
        if np.count_nonzero(turns < 0.0) > np.count_nonzero(turns > 0.0):
            rays, points, ranges, turn = rays[::-1], points[::-1], ranges[::-1], -1
    spacings = ranges * abs(increment_rad)
    # Where the first and the last ray are neighbours, the scan is cut open at its widest jump.
    ahead = np.roll(points, -1, axis=0) - points
    gaps = np.sqrt((ahead * ahead).sum(axis=1))
    if len(rays) > 1 and abs(increment_rad) * (len(points_m) + 1) >= 2.0 * math.pi:
        shift = -(int(gaps.argmax()) + 1)
        rays, points, ranges = (
            np.roll(rays, shift),
            np.roll(points, shift, axis=0),
            np.roll(ranges, shift),
        )
        spacings, gaps = np.roll(spacings, shift), np.roll(gaps, shift)
    between = np.minimum(np.abs(np.diff(rays)), _MAX_LOST_RAYS + 1)
    limit = _JUMP_RAYS * between * np.maximum(spacings[:-1], spacings[1:])
    breaks = gaps[:-1] > _JUMP_M + _JUMP_SIGMAS * noise_m + limit
    if known is not None:
        kind = known[rays]
        breaks |= kind[:-1] * kind[1:] < 0
    steps = np.full((2, len(rays)), _NOTHING_M)
    if len(rays):
        # A ray without a return between two points is free space beside both.
        skipped = np.abs(np.diff(rays)) > _MAX_LOST_RAYS + 1
        beside = np.where(skipped, _NOTHING_M, 0.0)
        steps[0, 1:] = np.maximum(ranges[:-1], beside) - ranges[1:]
        steps[1, :-1] = np.maximum(ranges[1:], beside) - ranges[:-1]
    first = np.concatenate([np.ones(min(len(rays), 1), dtype=bool), breaks])
    starts = np.flatnonzero(first)
    counts = np.diff(starts, append=len(points))
    ends = starts + counts - 1
    sums = np.add.reduceat(points, starts, axis=0) if len(starts) else np.zeros((0, 2))
    across = points[ends] - points[starts]
    return Clusters(
        points,
        ranges,
        rays,
        spacings,
        steps,
        starts,
        counts,
        sums / np.maximum(counts, 1)[:, None],
        np.sqrt((across * across).sum(axis=1)) + spacings[starts],
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
    points, cluster = clusters.points_m, clusters.cluster
    away = clusters.centres_m - clusters.origin_m
    ranges = np.maximum(np.sqrt((away * away).sum(axis=1)), 1e-6)
    ray = away / ranges[:, None]
    off = points - clusters.centres_m[cluster]
    x, y = off.T
    moments = clusters.sums(np.column_stack((x * x, y * y, x * y))) / counts[:, None]
    middle = 0.5 * (moments[:, 0] + moments[:, 1])
    spread = np.sqrt((0.5 * (moments[:, 0] - moments[:, 1])) ** 2 + moments[:, 2] ** 2)
    chord = points[ends] - points[starts]
    length = np.sqrt((chord * chord).sum(axis=1))
    # A cluster of one point has a chord across its ray.
    aside = np.column_stack((-ray[:, 1], ray[:, 0]))
    unit = np.where(length[:, None] > 1e-6, chord / np.maximum(length, 1e-6)[:, None], aside)
    normal = np.column_stack((-unit[:, 1], unit[:, 0]))  # away from the scanner is to the left
    to_chord = points - points[starts][cluster]
    bulge = (to_chord * normal[cluster]).sum(axis=1)
    bulges = clusters.sums(np.column_stack((bulge, bulge * bulge))) / counts[:, None]
    steps = np.clip(
        (clusters.steps_m[0, starts], clusters.steps_m[1, ends]), -_MAX_STEP_M, _MAX_STEP_M
    )
    rays = np.abs(clusters.rays[ends] - clusters.rays[starts]) + 1.0
    return np.column_stack(
        (
            np.log(counts),
            0.1 * ranges,
            10.0 * clusters.widths_m,
            10.0 * np.sqrt(middle + spread),
            10.0 * np.sqrt(np.maximum(middle - spread, 0.0)),
            10.0 * bulges[:, 0],
            10.0 * np.sqrt(np.maximum(bulges[:, 1] - bulges[:, 0] ** 2, 0.0)),
            steps[0],
            steps[1],
            (unit * ray).sum(axis=1),
            counts / rays,
        )
    )
