"""Metric scale of a skeleton, from its limb lengths and the average lengths of adults."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import compress
from operator import mul
from typing import Final

import numpy as np

from . import layouts as kp
from ._stages import PersonKeypoints
from .anthropometry import LIMBS, STATURE_RELATIVE_STD
from .arrays import FloatArray, median_of

#: Keypoints scored below this count as not seen.
DEFAULT_MIN_SCORE: Final = 0.3

# If the scale is within this limit (logarithm) of 1, the skeleton's unit is taken to be the metre;
# otherwise only its proportions are used.
_METRIC_UNIT_LIMIT: Final = 0.15
# Relative standard deviation of the person's size in a skeleton in metres.
_METRIC_UNIT_STD: Final = 0.03
# Relative standard deviations to add if no limb is seen, and for the foreshortening in a flat
# skeleton: 3–5 % for people who stand, 6–16 % for those who sit or bend, the more the less of them
# is seen.
_UNSEEN_RELATIVE_STD: Final = 0.10
_FLAT_RELATIVE_STD: Final = 0.125

_LOG_LENGTHS: Final[FloatArray] = np.log([limb.length_m for limb in LIMBS])
_INFORMATION: Final = tuple(limb.relative_std**-2 for limb in LIMBS)
# Inverse of the Huber limit: a vote counts less beyond 1.5 standard deviations.
_INVERSE_HUBER: Final = tuple(1.0 / (1.5 * limb.relative_std) for limb in LIMBS)


def _midpoint_matrix(ends: Sequence[tuple[int, ...]]) -> FloatArray:
    matrix = np.zeros((len(ends), 17))
    for row, columns in enumerate(ends):
        matrix[row, list(columns)] = 1.0 / len(columns)
    return matrix


# A row takes the keypoint, or the mean of the two keypoints, at one end of a limb.
_START_MATRIX: Final = _midpoint_matrix([limb.start for limb in LIMBS])
_END_MATRIX: Final = _midpoint_matrix([limb.end for limb in LIMBS])
#: (limbs, 17) end minus start of each limb of :data:`~perception.anthropometry.LIMBS`.
LIMB_DIFFERENCE: Final = _END_MATRIX - _START_MATRIX
#: (17, limbs) 1 where a limb uses a keypoint, else 0.
LIMB_KEYPOINTS: Final = ((_START_MATRIX + _END_MATRIX) > 0.0).T.astype(np.float64)


@dataclass(frozen=True, slots=True)
class MetricScale:
    """Factor from a skeleton's unit to metres.

    Attributes:
        factor: the factor, > 0.
        relative_std: its relative standard deviation, mostly the spread of adult stature.
    """

    factor: float
    relative_std: float


def metric_scale(
    person: PersonKeypoints, min_score: float = DEFAULT_MIN_SCORE
) -> MetricScale | None:
    """Estimate the scale of ``person.keypoints_root_m`` from its limb lengths.

    Each limb with both ends seen votes with the logarithm of (average length / lifted length). Its
    weight depends on how much the limb varies between adults of one stature, and Huber's weights
    limit the effect of a badly lifted limb. If the result is close to 1, the unit of the skeleton
    counts as metre and draws the scale towards 1. Without seen limbs all limbs vote, and the
    standard deviation is larger.

    In a flat skeleton (``lifted`` False) a limb that points at the camera looks short, and none
    looks long. There the limb with the second smallest vote gives the scale, and the unit does not
    count.

    Returns:
        The scale; None for a skeleton without any limb.
    """
    return metric_scales((person,), min_score)[0]


def metric_scales(
    people: Sequence[PersonKeypoints], min_score: float = DEFAULT_MIN_SCORE
) -> tuple[MetricScale | None, ...]:
    """Estimate the scales of several people at once, each as :func:`metric_scale` does."""
    return _metric_scales(tuple(people), min_score)


# Head poses and positions of a frame need the scales of the same people, so they are cached, for as
# many cameras as work side by side.
@lru_cache(maxsize=8)
def _metric_scales(
    people: tuple[PersonKeypoints, ...], min_score: float
) -> tuple[MetricScale | None, ...]:
    if not people:
        return ()
    hidden = np.array([person.scores[kp.BODY] for person in people]) < min_score
    ends = LIMB_DIFFERENCE @ np.array([person.keypoints_root_m[kp.BODY] for person in people])
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
    """Return the scale of one person from the votes of the limbs on its logarithm."""
    measured = any(usable)
    counted = usable if measured else present
    votes = list(compress(votes, counted))
    if not votes:
        return None
    information = list(compress(_INFORMATION, counted))
    inverse_huber = list(compress(_INVERSE_HUBER, counted))
    middle, total = median_of(votes), 0.0
    for _ in range(4):
        weights = [
            part / max(1.0, abs(vote - middle) * scale)
            for vote, part, scale in zip(votes, information, inverse_huber, strict=True)
        ]
        total = sum(weights)
        middle = sum(map(mul, weights, votes)) / total
    variance = 1.0 / total + STATURE_RELATIVE_STD**2 + person.scale_relative_std**2
    spread = math.sqrt(variance + (0.0 if measured else _UNSEEN_RELATIVE_STD**2))
    if not person.lifted:
        middle = sorted(votes)[1 if len(votes) >= 3 else 0]
        spread = math.hypot(spread, _FLAT_RELATIVE_STD)
    elif abs(middle) <= _METRIC_UNIT_LIMIT:
        middle *= _METRIC_UNIT_STD**2 / (_METRIC_UNIT_STD**2 + spread**2)
    return MetricScale(math.exp(middle), spread)
