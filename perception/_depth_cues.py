"""Range of a person from several cues, each of which may be an outlier."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

# Density of an outlier, and prior density of the range, over the logarithm of the range: uniform
# within a factor of e up or down.
_UNIFORM_DENSITY: Final = 0.5
# Standard deviation if every cue is an outlier.
_ALL_OUTLIERS_LOG_STD: Final = 0.5
_MAX_CUES: Final = 5
# By the number of cues: all subsets with at least one inlier.
_SUBSETS: Final = {
    count: tuple(inliers for inliers in product((False, True), repeat=count) if any(inliers))
    for count in range(2, _MAX_CUES + 1)
}


@dataclass(frozen=True, slots=True)
class DepthCue:
    """A measurement of a person's range that may be an outlier.

    Attributes:
        log_range: natural logarithm of the range, relative to any common reference.
        log_std: its standard deviation if the cue is no outlier, > 0.
        stature_std: the part of ``log_std`` from the unknown stature of the person. Errors of
            cues with such a part are correlated, in proportion to it.
        outlier_probability: probability in (0, 1) that the cue is unrelated to the range: feet
            that stand on something, the head of another person, a false skeleton.
        unusual_std: in place of ``stature_std`` for somebody whose stature is not that of an
            adult who stands: a child, somebody bent or seated.
    """

    log_range: float
    log_std: float
    stature_std: float
    outlier_probability: float
    unusual_std: float = 0.0


def combine_cues(cues: Sequence[DepthCue], unusual_probability: float = 0.0) -> tuple[float, float]:
    """Return the logarithm of the range and its standard deviation.

    Any subset of the cues may be the inliers. Within a subset the cues are combined by generalised
    least squares, with the covariance from their common stature. Each subset is weighted by its
    probability given all cues. The result is the weighted median of the subsets, which an unlikely
    subset cannot shift, and their root mean square distance from it. So cues that agree lower the
    standard deviation, a cue that disagrees with the others is outvoted, and if two cues contradict
    each other the standard deviation spans both. A single cue is returned unchanged.

    Args:
        cues: one to five cues.
        unusual_probability: that the person's stature is unusual. Cues that rest on the stature are
            then all wrong in the same way, so that one cue that does not can outvote them.
    """
    if len(cues) == 1:
        return cues[0].log_range, cues[0].log_std
    hypotheses = [([_terms(cue) for cue in cues], math.log1p(-unusual_probability))]
    if unusual_probability > 0.0:
        unusual = [
            _terms(
                replace(
                    cue,
                    log_std=math.hypot(_own_std(cue), cue.unusual_std),
                    stature_std=cue.unusual_std,
                )
            )
            for cue in cues
        ]
        hypotheses.append((unusual, math.log(unusual_probability)))
    terms = hypotheses[0][0]
    # If every cue is an outlier, only the prior density of the range is left to integrate.
    middle = _median([cue.log_range for cue in cues])
    all_outliers = sum(as_outlier for *_, as_outlier in terms) - math.log(_UNIFORM_DENSITY)
    found = [(middle, _ALL_OUTLIERS_LOG_STD**2, all_outliers)]
    for terms, prior in hypotheses:
        for inliers in _SUBSETS[len(cues)]:
            mean, variance, fit = _least_squares(terms, inliers)
            found.append((mean, variance, fit + prior))
    found.sort()
    highest = max(fit for *_, fit in found)
    weights = [math.exp(fit - highest) for *_, fit in found]
    total = sum(weights)
    # 1e-9: rounding must not carry the sum past a half that it reaches exactly.
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


def _own_std(cue: DepthCue) -> float:
    """Return the standard deviation of a cue but for the person's stature."""
    return math.sqrt(max(cue.log_std**2 - cue.stature_std**2, 1e-8))


def _terms(cue: DepthCue) -> tuple[float, ...]:
    """Return the terms that one cue adds to the sums of least squares, and its log densities.

    With the information w, stature s and value z: w, w s, w s², w z, w s z, w z², the log density
    as inlier without the exponent, and the log density as outlier.
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
        math.log1p(-cue.outlier_probability) - 0.5 * math.log(2.0 * math.pi * own),
        math.log(_UNIFORM_DENSITY * cue.outlier_probability),
    )


def _least_squares(
    terms: Sequence[tuple[float, ...]], inliers: Sequence[bool]
) -> tuple[float, float, float]:
    """Return mean, variance and log probability if exactly these cues are inliers."""
    one = s = ss = z = sz = zz = fit = 0.0
    for (a, b, c, d, e, f, as_inlier, as_outlier), is_inlier in zip(terms, inliers, strict=True):
        if not is_inlier:
            fit += as_outlier
            continue
        one, s, ss, z, sz, zz = one + a, s + b, ss + c, z + d, sz + e, zz + f
        fit += as_inlier
    # The covariance diag(own) + stature·statureᵀ is inverted by the Sherman–Morrison formula.
    shared = 1.0 / (1.0 + ss)
    information = max(one - s * s * shared, 1e-12)
    mean = (z - s * sz * shared) / information
    chi2 = max(zz - sz * sz * shared - information * mean * mean, 0.0)
    # Logarithm of ∫ N(values; x, Σ) dx over the inliers.
    fit -= 0.5 * (chi2 + math.log(information / (shared * 2.0 * math.pi)))
    return mean, 1.0 / information, fit


def _median(values: list[float]) -> float:
    values.sort()
    last = len(values) - 1
    return 0.5 * (values[last // 2] + values[(last + 1) // 2])
