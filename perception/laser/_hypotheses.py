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
_CUTOUT_OFFSETS_M: Final = np.linspace(-0.5 * _CUTOUT_M, 0.5 * _CUTOUT_M, CUTOUT)


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
    every = np.compress(returned, points_m.T, axis=1)
    features = cluster_features(clusters)
    first, second = _singles_and_pairs(clusters)
    pair = second >= 0
    left = np.where(pair, second, first)
    counts = clusters.counts
    first_x, first_y = np.take(clusters.centres_m.T, first, axis=1)
    left_x, left_y = np.take(clusters.centres_m.T, left, axis=1)
    middle = np.empty((2, len(first)))
    middle[0], middle[1] = 0.5 * (first_x + left_x), 0.5 * (first_y + left_y)
    away = middle - clusters.origin_m[:, None]
    ranges = np.maximum(np.sqrt((away * away).sum(axis=0)), 1e-6)
    rays = away / ranges
    apart_x, apart_y = left_x - first_x, left_y - first_y
    out = np.zeros((len(first), HYPOTHESIS_FEATURES), dtype=np.float32)
    out[:, :CLUSTER_FEATURES] = features[first]
    out[pair, CLUSTER_FEATURES : 2 * CLUSTER_FEATURES] = features[second[pair]]
    rest = out[:, 2 * CLUSTER_FEATURES :]
    rest[:, 0] = pair
    rest[:, 1] = 10.0 * np.sqrt(apart_x * apart_x + apart_y * apart_y)
    rest[:, 2] = 10.0 * (apart_x * rays[0] + apart_y * rays[1])
    rest[:, 3] = 10.0 * (rays[0] * apart_y - rays[1] * apart_x)
    rest[:, 4] = np.log(counts[first] + pair * counts[left])
    rest[:, 5] = 0.1 * _MAX_LEG_M / np.maximum(ranges * step, 0.005)
    own = clusters.sums(clusters.spacings_m)
    length = own[first] + pair * own[left]
    around = _around(every, ranges_m[returned] * step, middle)
    for row, near in enumerate(around):
        rest[:, 6 + row] = np.minimum(np.maximum(near - length, 0.0), _MAX_AROUND_M)
    ends = clusters.starts + counts - 1
    middle_ray = 0.5 * (clusters.rays[clusters.starts] + clusters.rays[ends])
    ray = 0.5 * (middle_ray[first] + middle_ray[left])
    rest[:, 8:] = _cutouts(ranges_m, ray, ranges, clusters.turn * step)
    return Hypotheses(first, second, middle.T, rays.T, out)


def _around(
    points_m: FloatArray, spacings_m: FloatArray, centres_m: FloatArray
) -> list[NDArray[np.float32]]:
    """Return the length (H,) of the surfaces (2, N) within each distance of centres (2, H)."""
    if not centres_m.size or not points_m.size:
        return [np.zeros(centres_m.shape[1], dtype=np.float32) for _ in _AROUND_M]
    # Half the precision and one matrix product: this is the largest table of a scan.
    origin = centres_m.mean(axis=1)[:, None]
    points = (points_m - origin).astype(np.float32)
    centres = (centres_m - origin).astype(np.float32)
    lengths = spacings_m.astype(np.float32)
    squares = centres.T @ (-2.0 * points)
    squares += (points * points).sum(axis=0)
    squares += (centres * centres).sum(axis=0)[:, None]
    return [(squares < radius * radius).astype(np.float32) @ lengths for radius in _AROUND_M]


def _cutouts(
    ranges_m: FloatArray, rows: FloatArray, middle_m: FloatArray, step_rad: float
) -> FloatArray:
    """Return (H, 49) ranges around each hypothesis from right to left, relative to its own.

    They show a width of 1.4 m at the hypothesis, and 0.7 m before and behind it, in units of 0.7 m.
    A ray without a return shows nothing as far as that.
    """
    rays = _CUTOUT_OFFSETS_M / (np.maximum(middle_m, 0.1)[:, None] * step_rad)
    rays += rows[:, None]
    rays += 0.5
    count = len(ranges_m)
    ray = np.floor(rays, out=rays).astype(np.int64)
    if abs(step_rad) * (count + 1) >= 2.0 * np.pi:
        ray %= count
    # Beside the scan is one ray more, without a return.
    np.minimum(np.maximum(ray, -1, out=ray), count, out=ray)
    depth = np.append(ranges_m, np.nan)[ray]
    depth -= middle_m[:, None]
    depth *= 1.0 / _CUTOUT_DEPTH_M
    return np.asarray(np.maximum(np.fmin(depth, 1.0), -1.0))


def _singles_and_pairs(clusters: Clusters) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    widths, counts, centres = clusters.widths_m, clusters.counts, clusters.centres_m
    away = centres - clusters.origin_m
    near = (away * away).sum(axis=1) <= _MAX_RANGE_M**2
    fits = near & (widths <= _MAX_WIDTH_M)
    single = np.flatnonzero(fits & (counts >= _MIN_POINTS))
    legs = np.flatnonzero(fits & (widths <= _MAX_LEG_M))
    # Every leg with each of the next few.
    one = np.broadcast_to(np.arange(len(legs)), (_NEIGHBOURS, len(legs)))
    other = one + np.arange(1, _NEIGHBOURS + 1)[:, None]
    inside = other < len(legs)
    one, other = legs[one[inside]], legs[other[inside]]
    apart = centres[other] - centres[one]
    chosen = apart[:, 0] * apart[:, 0] + apart[:, 1] * apart[:, 1] <= _MAX_STEP_M**2
    chosen &= counts[one] + counts[other] > _MIN_POINTS
    return (
        np.concatenate([single, one[chosen]]),
        np.concatenate([np.full(len(single), -1), other[chosen]]),
    )
