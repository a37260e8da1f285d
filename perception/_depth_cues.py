"""How far away a person is: cues that may each be wrong, combined by their uncertainties."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from .arrays import FloatArray

# Density of a cue that is wrong, and of ranges before anything is known, over the logarithm of the
# range: flat within a factor of e up or down.
_FLAT_DENSITY: Final = 0.5
# What is left when every cue is wrong.
_ALL_WRONG_LOG_STD: Final = 0.5
_MAX_CUES: Final = 5


@dataclass(frozen=True, slots=True)
class DepthCue:
    """One opinion about the range of a person.

    Attributes:
        log_range: natural logarithm of the range, relative to any common reference.
        log_std: its standard deviation when the cue is right, > 0.
        stature_std: the part of ``log_std`` that comes from not knowing the person's stature. Cues
            that have such a part err together, in proportion to it.
        wrong: probability that the cue has nothing to do with the range, in (0, 1): feet that
            stand on something, a head that is somebody else's, a skeleton that is none.
    """

    log_range: float
    log_std: float
    stature_std: float
    wrong: float


def combine_cues(cues: Sequence[DepthCue]) -> tuple[float, float]:
    """Return the logarithm of the range and its standard deviation.

    Any subset of the cues may be the right ones. Within a subset they are combined by generalised
    least squares, with the covariance that their common stature gives; the subsets weigh by their
    probability given what all cues say. Their weighted median is returned, which no unlikely subset
    can drag along, and the root mean square distance of all of them from it. Cues that agree
    sharpen each other; one that disagrees by more than its errors allow is outvoted, and where two
    contradict each other the standard deviation spans both. A single cue is returned as it is:
    there is nothing to check it against.

    Args:
        cues: one to five.
    """
    if len(cues) == 1:
        return cues[0].log_range, cues[0].log_std
    value, std, stature, wrong = np.array(
        [(cue.log_range, cue.log_std, cue.stature_std, cue.wrong) for cue in cues]
    ).T
    right = _SUBSETS[len(cues)]
    own = np.maximum(std**2 - stature**2, 1e-8)
    # Covariance diag(own) + stature·statureᵀ of each subset, inverted after Sherman and Morrison.
    terms = np.stack([np.ones_like(value), stature, stature**2, value, stature * value, value**2])
    one, s, ss, z, sz, zz = (terms / own) @ right.T
    shared = 1.0 / (1.0 + ss)
    information = np.maximum(one - s * s * shared, 1e-12)
    mean = (z - s * sz * shared) / information
    chi2 = np.maximum(zz - sz * sz * shared - information * mean**2, 0.0)
    size = right.sum(axis=1)
    # Logarithm of ∫ N(values; x, Σ) dx for the right ones, flat for the others.
    fit = -0.5 * (
        chi2
        + (size - 1) * math.log(2.0 * math.pi)
        + right @ np.log(own)
        - np.log(shared)
        + np.log(information)
    )
    prior = right @ np.log1p(-wrong) + (1.0 - right) @ np.log(_FLAT_DENSITY * wrong)
    # The first subset is the empty one: the range itself is all that is left to integrate over.
    fit[0] = -math.log(_FLAT_DENSITY)
    mean[0] = float(np.median(value))
    variance = 1.0 / information
    variance[0] = _ALL_WRONG_LOG_STD**2
    weight = np.exp(fit + prior - np.max(fit + prior))
    weight /= weight.sum()
    order = np.argsort(mean)
    middle = np.searchsorted(np.cumsum(weight[order]), 0.5 - 1e-9)
    centre = float(mean[order[min(int(middle), len(order) - 1)]])
    return centre, math.sqrt(float(weight @ (variance + (mean - centre) ** 2)))


def _subsets(count: int) -> FloatArray:
    """(2^count, count) of ones and zeros, the empty subset first."""
    rows = (np.arange(2**count)[:, None] >> np.arange(count)) & 1
    return np.asarray(rows, dtype=np.float64)


_SUBSETS: Final = {count: _subsets(count) for count in range(2, _MAX_CUES + 1)}
