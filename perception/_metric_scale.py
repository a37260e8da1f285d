"""Metric scale of a lifted skeleton from limb lengths and anthropometric averages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ._keypoints import PersonKeypoints
from .anthropometry import LIMBS, STATURE_RELATIVE_STD
from .arrays import FloatArray

#: Keypoints scored below this count as not seen.
DEFAULT_MIN_SCORE: Final = 0.3

# A skeleton whose limbs are within this fraction of an average adult's is taken at its word that
# its unit is the metre; further off, only its proportions are used.
_METRIC_CLAIM_LIMIT: Final = 0.15
# How far a network that is right about its unit is wrong about the person's size.
_METRIC_CLAIM_STD: Final = 0.03

# How much less a limb says that the network lifted without seeing it.
_GUESSED_RELATIVE_STD: Final = 0.10

_LOG_LENGTHS: Final[FloatArray] = np.log([limb.length_m for limb in LIMBS])
_STDS: Final[FloatArray] = np.array([limb.relative_std for limb in LIMBS])


def _midpoint_matrix(ends: Sequence[tuple[int, ...]]) -> FloatArray:
    matrix = np.zeros((len(ends), 17))
    for row, columns in enumerate(ends):
        matrix[row, list(columns)] = 1.0 / len(columns)
    return matrix


# Rows pick (or average) the keypoints at either end of each limb.
_START_MATRIX: Final = _midpoint_matrix([limb.start for limb in LIMBS])
_END_MATRIX: Final = _midpoint_matrix([limb.end for limb in LIMBS])
_DIFFERENCE: Final = _END_MATRIX - _START_MATRIX
_INVOLVED: Final = (_START_MATRIX + _END_MATRIX) > 0.0


@dataclass(frozen=True, slots=True)
class MetricScale:
    """Factor from a skeleton's own unit to metres.

    Attributes:
        factor: > 0.
        relative_std: its relative standard deviation, mostly the spread of adult stature.
    """

    factor: float
    relative_std: float


def metric_scale(
    person: PersonKeypoints, min_score: float = DEFAULT_MIN_SCORE
) -> MetricScale | None:
    """Estimate the scale of ``person.keypoints_root_m`` from its limb lengths.

    Each visible limb votes with the logarithm of (average length / lifted length), weighted by how
    much that limb varies between adults of one stature; Huber's weights keep a badly lifted limb
    from mattering. The skeleton's own claim to be in metres counts as one more vote when it is
    plausible. Where no limb is visible at both ends, what the network guessed of the hidden ones
    serves, with a spread to match. Returns None for a skeleton without any limb.
    """
    seen = person.scores[:17] >= min_score
    lengths = np.linalg.norm(_DIFFERENCE @ person.keypoints_root_m[:17], axis=1)
    present = lengths > 1e-9
    usable = present & ~np.any(_INVOLVED & ~seen, axis=1)
    guessed = 0.0
    if not usable.any():
        usable, guessed = present, _GUESSED_RELATIVE_STD
    if not usable.any():
        return None
    votes = _LOG_LENGTHS[usable] - np.log(lengths[usable])
    std = _STDS[usable]
    centre = float(np.median(votes))
    for _ in range(4):
        distance = np.abs(votes - centre) / std
        weight = np.minimum(1.0, 1.5 / np.maximum(distance, 1e-9)) / std**2
        centre = float(np.sum(weight * votes) / np.sum(weight))
    variance = 1.0 / float(np.sum(weight)) + STATURE_RELATIVE_STD**2 + guessed**2
    spread = math.sqrt(variance)
    if abs(centre) <= _METRIC_CLAIM_LIMIT:
        centre *= _METRIC_CLAIM_STD**2 / (_METRIC_CLAIM_STD**2 + variance)
    return MetricScale(math.exp(centre), spread)
