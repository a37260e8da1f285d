"""Hypotheses of people in a scan: single clusters, and pairs that may be two legs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from ._clusters import CLUSTER_FEATURES, Clusters, cluster_features

#: Number of ranges across a hypothesis and its surroundings.
CUTOUT: Final = 49
#: Number of features of a hypothesis: two clusters, the pair, what is around, and a cutout.
HYPOTHESIS_FEATURES: Final = 2 * CLUSTER_FEATURES + 8 + CUTOUT

# Widest cluster that may be two legs at once, or one leg; narrower than a trolley.
_MAX_WIDTH_M: Final = 0.65
_MAX_LEG_M: Final = 0.45
# Farthest apart that the ankles of one person are in a fast walk.
_MAX_STEP_M: Final = 0.95
# Clusters in the order of the scan between which pairs are formed.
_NEIGHBOURS: Final = 4
# Fewest points of a hypothesis.
_MIN_POINTS: Final = 2
# Beyond this range a leg is met by one ray or none.
_MAX_RANGE_M: Final = 12.0
# Surfaces around a hypothesis are summed up to these distances.
_AROUND_M: Final = (0.5, 1.0)
_MAX_AROUND_M: Final = 3.0
# Width of a cutout, and the depth before and behind the hypothesis that it shows.
_CUTOUT_M: Final = 1.4
_CUTOUT_DEPTH_M: Final = 0.7


@dataclass(frozen=True, slots=True, eq=False)
class Hypotheses:
    """H hypotheses.

    Attributes:
        first: (H,) cluster at the right, seen from the scanner.
        second: (H,) cluster at the left; −1 for a single cluster.
        centres_m: (H, 2) middle of the clusters.
        rays: (H, 2) unit vector from the scanner to the centre.
        features: (H, 79), float32, as :data:`HYPOTHESIS_FEATURES` says.
    """

    first: NDArray[np.int64]
    second: NDArray[np.int64]
    centres_m: FloatArray
    rays: FloatArray
    features: NDArray[np.float32]


def hypotheses_of(
    clusters: Clusters, points_m: FloatArray, ranges_m: FloatArray, increment_rad: float
) -> Hypotheses:
    """Return the hypotheses about people that clusters allow.

    Args:
        clusters: clusters of the scan.
        points_m: (N, 2) all points of the scan, also of known walls; NaN without a return.
        ranges_m: (N,) their ranges; NaN without a return.
        increment_rad: angle between rays.
    """
    returned = np.isfinite(ranges_m)
    step = abs(increment_rad)
    points_m, spacings_m = points_m[returned], ranges_m[returned] * step
    features = cluster_features(clusters)
    first, second = _singles_and_pairs(clusters)
    pair = second >= 0
    left = np.where(pair, second, first)
    centres, counts = clusters.centres_m, clusters.counts
    middle = 0.5 * (centres[first] + centres[left])
    away = middle - clusters.origin_m
    ranges = np.maximum(np.sqrt((away * away).sum(axis=1)), 1e-6)
    rays = away / ranges[:, None]
    apart = centres[left] - centres[first]
    along = (apart * rays).sum(axis=1)
    across = rays[:, 0] * apart[:, 1] - rays[:, 1] * apart[:, 0]
    out = np.zeros((len(first), HYPOTHESIS_FEATURES))
    out[:, :CLUSTER_FEATURES] = features[first]
    out[pair, CLUSTER_FEATURES : 2 * CLUSTER_FEATURES] = features[second[pair]]
    own = clusters.sums(clusters.spacings_m)
    rest = out[:, 2 * CLUSTER_FEATURES :]
    rest[:, 0] = pair
    rest[:, 1] = 10.0 * np.sqrt((apart * apart).sum(axis=1))
    rest[:, 2] = 10.0 * along
    rest[:, 3] = 10.0 * across
    rest[:, 4] = np.log(counts[first] + np.where(pair, counts[left], 0))
    rest[:, 5] = 0.1 * _MAX_LEG_M / np.maximum(ranges * step, 0.005)
    length = own[first] + np.where(pair, own[left], 0.0)
    for row, around in enumerate(_around(points_m, spacings_m, middle)):
        rest[:, 6 + row] = np.clip(around - length, 0.0, _MAX_AROUND_M)
    ray = 0.5 * (_middle_rays(clusters)[first] + _middle_rays(clusters)[left])
    rest[:, 8:] = _cutouts(ranges_m, ray, ranges, clusters.turn * step)
    return Hypotheses(first, second, middle, rays, out.astype(np.float32))


def _around(
    points_m: FloatArray, spacings_m: FloatArray, centres_m: FloatArray
) -> list[NDArray[np.float32]]:
    """Return the length (H,) of the surfaces within each distance of centres (H, 2)."""
    if not len(centres_m) or not len(points_m):
        return [np.zeros(len(centres_m), dtype=np.float32) for _ in _AROUND_M]
    # Half the precision and one matrix product: this is the largest table of a scan.
    origin = centres_m.mean(axis=0)
    points = (points_m - origin).astype(np.float32)
    centres = (centres_m - origin).astype(np.float32)
    lengths = spacings_m.astype(np.float32)
    squares = centres @ (-2.0 * points.T)
    squares += (points * points).sum(axis=1)
    squares += (centres * centres).sum(axis=1)[:, None]
    return [(squares < radius * radius).astype(np.float32) @ lengths for radius in _AROUND_M]


def _middle_rays(clusters: Clusters) -> FloatArray:
    """Return (C,) the row of the middle ray of each cluster."""
    ends = clusters.starts + clusters.counts - 1
    return np.asarray(0.5 * (clusters.rays[clusters.starts] + clusters.rays[ends]))


def _cutouts(
    ranges_m: FloatArray, rows: FloatArray, middle_m: FloatArray, step_rad: float
) -> FloatArray:
    """Return (H, 49) ranges around each hypothesis from right to left, relative to its own.

    They show a width of 1.4 m at the hypothesis, and 0.7 m before and behind it, in units of 0.7 m.
    A ray without a return shows nothing as far as that.
    """
    offsets = np.linspace(-0.5 * _CUTOUT_M, 0.5 * _CUTOUT_M, CUTOUT)
    ray = rows[:, None] + offsets / (np.maximum(middle_m, 0.1)[:, None] * step_rad)
    count = len(ranges_m)
    ray = np.floor(ray + 0.5).astype(np.int64)
    if abs(step_rad) * (count + 1) >= 2.0 * np.pi:
        ray %= count
    inside = (ray >= 0) & (ray < count)
    depth = ranges_m[np.where(inside, ray, 0)] - middle_m[:, None]
    depth = np.where(inside & np.isfinite(depth), depth, _CUTOUT_DEPTH_M)
    scale = 1.0 / _CUTOUT_DEPTH_M
    return np.asarray(np.minimum(np.maximum(depth * scale, -1.0), 1.0))


def _singles_and_pairs(clusters: Clusters) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    widths, counts, centres = clusters.widths_m, clusters.counts, clusters.centres_m
    away = centres - clusters.origin_m
    near = (away * away).sum(axis=1) <= _MAX_RANGE_M**2
    fits = near & (widths <= _MAX_WIDTH_M)
    single = np.flatnonzero(fits & (counts >= _MIN_POINTS))
    legs = np.flatnonzero(fits & (widths <= _MAX_LEG_M))
    firsts, seconds = [single], [np.full(len(single), -1)]
    for step in range(1, _NEIGHBOURS + 1):
        one, other = legs[:-step], legs[step:]
        apart = centres[other] - centres[one]
        chosen = (apart * apart).sum(axis=1) <= _MAX_STEP_M**2
        chosen &= counts[one] + counts[other] > _MIN_POINTS
        firsts.append(one[chosen])
        seconds.append(other[chosen])
    return np.concatenate(firsts), np.concatenate(seconds)
