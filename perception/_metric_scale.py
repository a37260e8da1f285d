"""Metric scale of a lifted skeleton from limb lengths and anthropometric averages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import compress
from operator import mul
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
# What foreshortening leaves open where the skeleton is flat.
_FLAT_RELATIVE_STD: Final = 0.08

_LOG_LENGTHS: Final[FloatArray] = np.log([limb.length_m for limb in LIMBS])
_INFORMATION: Final = tuple(limb.relative_std**-2 for limb in LIMBS)
# A vote counts less from one and a half standard deviations on.
_PER_HUBER: Final = tuple(1.0 / (1.5 * limb.relative_std) for limb in LIMBS)


def _midpoint_matrix(ends: Sequence[tuple[int, ...]]) -> FloatArray:
    matrix = np.zeros((len(ends), 17))
    for row, columns in enumerate(ends):
        matrix[row, list(columns)] = 1.0 / len(columns)
    return matrix


# Rows pick (or average) the keypoints at either end of each limb.
_START_MATRIX: Final = _midpoint_matrix([limb.start for limb in LIMBS])
_END_MATRIX: Final = _midpoint_matrix([limb.end for limb in LIMBS])
#: (limbs, 17) end minus start of each limb of :data:`~perception.anthropometry.LIMBS`.
LIMB_DIFFERENCE: Final = _END_MATRIX - _START_MATRIX
#: (17, limbs) 1 where a limb needs a keypoint.
LIMB_KEYPOINTS: Final = ((_START_MATRIX + _END_MATRIX) > 0.0).T.astype(np.float64)


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
    serves, with a spread to match. In a flat skeleton (``lifted`` False) a limb that points at the
    camera looks short and none looks long: the second longest counts, and the unit claims nothing.
    Returns None for a skeleton without any limb.
    """
    return metric_scales((person,), min_score)[0]


def metric_scales(
    people: Sequence[PersonKeypoints], min_score: float = DEFAULT_MIN_SCORE
) -> tuple[MetricScale | None, ...]:
    """Return :func:`metric_scale` of several people at once."""
    return _metric_scales(tuple(people), min_score)


# Finding heads and placing bodies ask for the scales of the same people, who never change.
@lru_cache(maxsize=1)
def _metric_scales(
    people: tuple[PersonKeypoints, ...], min_score: float
) -> tuple[MetricScale | None, ...]:
    if not people:
        return ()
    hidden = np.array([person.scores[:17] for person in people]) < min_score
    ends = LIMB_DIFFERENCE @ np.array([person.keypoints_root_m[:17] for person in people])
    lengths = np.sqrt((ends * ends).sum(axis=2))
    present = lengths > 1e-9
    usable = present & (hidden @ LIMB_KEYPOINTS == 0.0)
    votes = _LOG_LENGTHS - np.log(np.maximum(lengths, 1e-9))
    return tuple(
        _scale(*row)
        for row in zip(people, votes.tolist(), usable.tolist(), present.tolist(), strict=True)
    )


def _scale(
    person: PersonKeypoints, votes: list[float], usable: list[bool], present: list[bool]
) -> MetricScale | None:
    """Scale of one person from what each limb says of its logarithm."""
    measured = any(usable)
    counted = usable if measured else present
    votes = list(compress(votes, counted))
    if not votes:
        return None
    information = list(compress(_INFORMATION, counted))
    per_huber = list(compress(_PER_HUBER, counted))
    ordered, last = sorted(votes), len(votes) - 1
    middle, total = 0.5 * (ordered[last // 2] + ordered[(last + 1) // 2]), 0.0
    for _ in range(4):
        weights = [
            part / max(1.0, abs(vote - middle) * scale)
            for vote, part, scale in zip(votes, information, per_huber, strict=True)
        ]
        total = sum(weights)
        middle = sum(map(mul, weights, votes)) / total
    variance = 1.0 / total + STATURE_RELATIVE_STD**2 + person.scale_relative_std**2
    spread = math.sqrt(variance + (0.0 if measured else _GUESSED_RELATIVE_STD**2))
    if not person.lifted:
        middle = ordered[1 if len(votes) >= 3 else 0]
        spread = math.hypot(spread, _FLAT_RELATIVE_STD)
    elif abs(middle) <= _METRIC_CLAIM_LIMIT:
        middle *= _METRIC_CLAIM_STD**2 / (_METRIC_CLAIM_STD**2 + spread**2)
    return MetricScale(math.exp(middle), spread)
