"""Hypotheses of people in a scan, single clusters and pairs, and the network that judges them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._manifest import LEGS
from ..arrays import FloatArray
from ..errors import PerceptionError
from ..networks import OnnxModel, OnnxSettings
from ._clusters import CLUSTER_FEATURES, Clusters, cluster_features

AnyArray = TypeVar("AnyArray", FloatArray, NDArray[np.int64])

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
        left: (H,) the same, but the first cluster for a single one.
        centres_m: (H, 2) middle of the clusters.
        rays: (H, 2) unit vector from the scanner to the centre.
        features: (H, 79), float32, as :data:`HYPOTHESIS_FEATURES` says.
    """

    first: NDArray[np.int64]
    second: NDArray[np.int64]
    left: NDArray[np.int64]
    centres_m: FloatArray
    rays: FloatArray
    features: NDArray[np.float32]


def hypotheses_of(
    clusters: Clusters,
    points_m: FloatArray,
    ranges_m: FloatArray,
    increment_rad: float,
    ruled_out: NDArray[np.bool_] | None = None,
) -> Hypotheses:
    """Return the hypotheses about people that clusters allow.

    Args:
        clusters: clusters of the scan.
        points_m: (N, 2) all points of the scan, also of known walls; NaN without a return.
        ranges_m: (N,) their ranges; NaN without a return.
        increment_rad: angle between rays.
        ruled_out: (C,) clusters without hypotheses; None for none. The other hypotheses are the
            same with and without it.
    """
    step = abs(increment_rad)
    # Single clusters come first, then the pairs; ``left`` of a single one is the cluster itself.
    single, one, other = _singles_and_pairs(clusters)
    first, left = np.concatenate([single, one]), np.concatenate([single, other])
    singles = len(single)
    centres = clusters.centres_m.T
    right_m, left_m = centres.take(first, axis=1), centres.take(left, axis=1)
    middle = right_m + left_m
    middle *= 0.5
    kept, every_middle = np.arange(len(first)), middle
    if ruled_out is not None:
        kept = (~(ruled_out[first] | ruled_out[left])).nonzero()[0]
        singles = int(np.searchsorted(kept, singles))
        first, left, middle = first[kept], left[kept], middle[:, kept]
        right_m, left_m = right_m[:, kept], left_m[:, kept]
    second = left.copy()
    second[:singles] = -1
    if not len(first):
        features = np.zeros((0, HYPOTHESIS_FEATURES), dtype=np.float32)
        return Hypotheses(first, second, left, middle.T, np.zeros((0, 2)), features)
    other, pairs = left[singles:], slice(singles, None)
    away = middle - clusters.origin_m[:, None]
    squares = away * away
    ranges = np.maximum(np.sqrt(squares[0] + squares[1]), 1e-6)
    rays = away / ranges
    apart = left_m - right_m
    squares = apart * apart
    own = cluster_features(clusters)
    out = np.zeros((len(first), HYPOTHESIS_FEATURES), dtype=np.float32)
    out[:, :CLUSTER_FEATURES] = own.take(first, axis=1).T
    out[pairs, CLUSTER_FEATURES : 2 * CLUSTER_FEATURES] = own.take(other, axis=1).T
    pair = np.zeros((8, len(first)))
    pair[0, pairs] = 1.0
    np.sqrt(squares[0] + squares[1], out=pair[1])
    pair[2] = apart[0] * rays[0] + apart[1] * rays[1]
    pair[3] = rays[0] * apart[1] - rays[1] * apart[0]
    pair[1:4] *= 10.0
    np.log(_of_both(clusters.counts, first, other), out=pair[4])
    np.divide(0.1 * _MAX_LEG_M, np.maximum(ranges * step, 0.005), out=pair[5])
    returned = np.isfinite(ranges_m).nonzero()[0]
    # The sums of all hypotheses, so that their rounding does not depend on those that are kept.
    around = _around(points_m.T.take(returned, axis=1), ranges_m[returned] * step, every_middle)[
        :, kept
    ]
    around -= _of_both(clusters.lengths_m, first, other)
    np.minimum(np.maximum(around, 0.0, out=around), _MAX_AROUND_M, out=pair[6:])
    out[:, 2 * CLUSTER_FEATURES : -CUTOUT] = pair.T
    middle_ray = 0.5 * (clusters.rays[clusters.starts] + clusters.rays[clusters.ends])
    ray = 0.5 * (middle_ray[first] + middle_ray[left])
    out[:, -CUTOUT:] = _cutouts(ranges_m, ray, ranges, clusters.turn * step)
    return Hypotheses(first, second, left, middle.T, rays.T, out)


def _of_both(values: AnyArray, first: NDArray[np.int64], other: NDArray[np.int64]) -> AnyArray:
    """Return values of clusters summed over each hypothesis; ``other`` are those of the pairs."""
    sums = values[first]
    sums[len(first) - len(other) :] += values[other]
    return sums


def _around(points_m: FloatArray, spacings_m: FloatArray, centres_m: FloatArray) -> FloatArray:
    """Return the length of the surfaces (2, N) within each distance of centres (2, H), (2, H)."""
    out = np.zeros((len(_AROUND_M), centres_m.shape[1]))
    if not points_m.size:
        return out
    # Half the precision and one matrix product: this is the largest table of a scan.
    origin = (np.add.reduce(centres_m, axis=1) / centres_m.shape[1])[:, None]
    points = (points_m - origin).astype(np.float32)
    centres = (centres_m - origin).astype(np.float32)
    lengths = spacings_m.astype(np.float32)
    squares = centres.T @ (-2.0 * points)
    points *= points
    squares += points[0] + points[1]
    centres *= centres
    squares += (centres[0] + centres[1])[:, None]
    for row, radius in enumerate(_AROUND_M):
        out[row] = (squares < radius * radius).astype(np.float32) @ lengths
    return out


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


def _singles_and_pairs(
    clusters: Clusters,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the single clusters (S,), and the right and the left one (P,) of each pair."""
    widths, counts, centres = clusters.widths_m, clusters.counts, clusters.centres_m.T
    away = centres - clusters.origin_m[:, None]
    away *= away
    fits = (away[0] + away[1] <= _MAX_RANGE_M**2) & (widths <= _MAX_WIDTH_M)
    single = (fits & (counts >= _MIN_POINTS)).nonzero()[0]
    legs = (fits & (widths <= _MAX_LEG_M)).nonzero()[0]
    # Every leg with each of the next few.
    one, other = legs[_neighbours(len(legs))]
    apart = centres.take(other, axis=1) - centres.take(one, axis=1)
    apart *= apart
    chosen = apart[0] + apart[1] <= _MAX_STEP_M**2
    chosen &= counts[one] + counts[other] > _MIN_POINTS
    return single, one[chosen], other[chosen]


@lru_cache(maxsize=256)
def _neighbours(count: int) -> NDArray[np.int64]:
    """Return (2, P) the pairs of each of a row of things with each of the next few."""
    steps = [np.arange(max(count - step, 0)) for step in range(1, _NEIGHBOURS + 1)]
    others = [one + step for step, one in enumerate(steps, 1)]
    return np.stack([np.concatenate(steps), np.concatenate(others)])


#: Values that a classifier returns for each hypothesis.
JUDGEMENT_SIZE: Final = 5


class LegClassifier(Protocol):
    """Judges hypotheses about people."""

    def __call__(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (H, 5) for features (H, 79).

        They are: the probability of a person; the person's place from the middle of the clusters,
        away from the scanner and to its left; and the standard deviations of both, in metres.
        """
        ...


class OnnxLegClassifier:
    """A classifier from an ONNX file.

    Args:
        path: file with one input (any, 79) and one output (any, 5), both float32; None for the
            shipped network, whose SHA-256 is checked.

    Raises:
        PerceptionError: for a file that cannot be loaded or has another layout.
    """

    def __init__(self, path: str | Path | None = None) -> None:
        settings = OnnxSettings(intra_op_threads=1)
        self._model = (
            OnnxModel.shipped(LEGS, settings)
            if path is None
            else OnnxModel(path, settings=settings)
        )
        inputs, outputs = self._model.inputs, self._model.outputs
        shapes = [tensor.shape for tensor in (*inputs, *outputs)]
        if shapes != [(None, HYPOTHESIS_FEATURES), (None, JUDGEMENT_SIZE)]:
            raise PerceptionError(
                f"a leg classifier has the layout (any, {HYPOTHESIS_FEATURES}) -> "
                f"(any, {JUDGEMENT_SIZE}), got {self._model.layout}"
            )
        self._input = inputs[0].name

    def __call__(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (H, 5) for features (H, 79); see :class:`LegClassifier`."""
        if not len(features):
            return np.zeros((0, JUDGEMENT_SIZE), dtype=np.float32)
        (judged,) = self._model.run({self._input: features}, timed=False)
        return judged
