"""How far away a person is: cues that may each be wrong, combined by their uncertainties."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

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
    terms = [_terms(cue) for cue in cues]
    # Nothing is right: the range itself is all that is left to integrate over.
    middle = _median([cue.log_range for cue in cues])
    nothing = sum(wrong for *_, wrong in terms) - math.log(_FLAT_DENSITY)
    found = [(middle, _ALL_WRONG_LOG_STD**2, nothing)]
    found += [_least_squares(terms, right) for right in _SUBSETS[len(cues)]]
    found.sort()
    highest = max(fit for *_, fit in found)
    weights = [math.exp(fit - highest) for *_, fit in found]
    total = sum(weights)
    # Rounding must not carry the sum past a half that it reaches exactly.
    half, centre = (0.5 - 1e-9) * total, found[-1][0]
    for (mean, _, _), weight in zip(found, weights, strict=True):
        half -= weight
        if half <= 0.0:
            centre = mean
            break
    spread = sum(
        weight * (variance + (mean - centre) ** 2)
        for (mean, variance, _), weight in zip(found, weights, strict=True)
    )
    return centre, math.sqrt(spread / total)


def _terms(cue: DepthCue) -> tuple[float, ...]:
    """The sums of least squares that one cue adds, and the logarithms of its densities.

    Information alone, with stature once and twice, with value, with both, with value twice; density
    when right, but for the exponent, and when wrong.
    """
    value, stature = cue.log_range, cue.stature_std
    own = max(cue.log_std**2 - stature**2, 1e-8)
    one = 1.0 / own
    return (
        one,
        one * stature,
        one * stature * stature,
        one * value,
        one * stature * value,
        one * value * value,
        math.log1p(-cue.wrong) - 0.5 * math.log(2.0 * math.pi * own),
        math.log(_FLAT_DENSITY * cue.wrong),
    )


def _least_squares(
    terms: Sequence[tuple[float, ...]], right: Sequence[bool]
) -> tuple[float, float, float]:
    """Mean, variance and logarithm of the probability where some of the cues are the right ones."""
    one = s = ss = z = sz = zz = fit = 0.0
    for (a, b, c, d, e, f, as_right, as_wrong), believed in zip(terms, right, strict=True):
        if not believed:
            fit += as_wrong
            continue
        one, s, ss, z, sz, zz = one + a, s + b, ss + c, z + d, sz + e, zz + f
        fit += as_right
    # Covariance diag(own) + stature·statureᵀ, inverted after Sherman and Morrison.
    shared = 1.0 / (1.0 + ss)
    information = max(one - s * s * shared, 1e-12)
    mean = (z - s * sz * shared) / information
    chi2 = max(zz - sz * sz * shared - information * mean * mean, 0.0)
    # Logarithm of ∫ N(values; x, Σ) dx for the right ones.
    fit -= 0.5 * (chi2 + math.log(information / (shared * 2.0 * math.pi)))
    return mean, 1.0 / information, fit


def _median(values: list[float]) -> float:
    values.sort()
    last = len(values) - 1
    return 0.5 * (values[last // 2] + values[(last + 1) // 2])


#: By the number of cues: every way in which at least one of them is right.
_SUBSETS: Final = {
    count: tuple(right for right in product((False, True), repeat=count) if any(right))
    for count in range(2, _MAX_CUES + 1)
}
