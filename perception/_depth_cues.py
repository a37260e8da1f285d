"""Range of a person from several cues, each of which may be an outlier."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final, NamedTuple

from .arrays import median_of

# Density of an outlier, and prior density of the range, over the logarithm of the range: uniform
# within a factor of e up or down.
_UNIFORM_DENSITY: Final = 0.5
# Standard deviation if every cue is an outlier.
_ALL_OUTLIERS_LOG_STD: Final = 0.5
_MAX_CUES: Final = 5
#: A shelf hides about half of somebody: a box is then half as high.
HIDDEN_OFFSET: Final = 0.7
# Probability that something hides the lower part of a person of whom there is a box alone, and the
# spread (logarithm) of how much of the height it hides.
_HIDDEN_PROBABILITY: Final = 0.05
_HIDDEN_STD: Final = 0.25
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
        unusual_offset: by how much the cue is then too large on average.
        outlier_farther: share of the outliers that lie beyond the person. Feet that stand on
            something, or that something hides, seem farther away than they are.
        hidden_offset: by how much the cue is too large on average if the lower part of the person
            is hidden: of a box, whose height is then too small. Infinite for a cue that is an
            outlier then: the lower edge is that of what hides them. 0 for other cues.
    """

    log_range: float
    log_std: float
    stature_std: float
    outlier_probability: float
    unusual_std: float = 0.0
    unusual_offset: float = 0.0
    outlier_farther: float = 0.5
    hidden_offset: float = 0.0


class CombinedRange(NamedTuple):
    """The range that several cues give together.

    Attributes:
        log_range: its natural logarithm, relative to the reference of the cues.
        log_std: its standard deviation.
        lasting_std: the part of ``log_std`` that is the same in every image of a person: from the
            stature, and from which of the cues are right.
    """

    log_range: float
    log_std: float
    lasting_std: float


class _Terms(NamedTuple):
    """The terms that one cue adds to the sums of least squares, and its log densities.

    With the information w, stature s and value z: w, w s, w s², w z, w s z, w z², the log density
    as inlier without the exponent, and the log density as outlier.
    """

    w: float
    ws: float
    wss: float
    wz: float
    wsz: float
    wzz: float
    as_inlier: float
    as_outlier: float


def combined_range(cues: Sequence[DepthCue], unusual_probability: float = 0.0) -> CombinedRange:
    """Combine the cues for the range of one person.

    Any subset of the cues may be the inliers. Within a subset the cues are combined by generalised
    least squares, with the covariance from their common stature. Each subset is weighted by its
    probability given all cues. The result is the weighted median of the subsets, which an unlikely
    subset cannot shift, and their root mean square distance from it. So cues that agree lower the
    standard deviation, a cue that disagrees with the others is outvoted, and if two cues contradict
    each other the standard deviation spans both.

    A single cue is returned unchanged, except that its standard deviation is that of the mixture of
    usual and unusual statures about the usual one.

    Args:
        cues: one to five cues.
        unusual_probability: that the person's stature is unusual. Cues that rest on the stature are
            then all wrong in the same way, so that one cue that does not can outvote them.
    """
    if len(cues) == 1:
        return _single(cues[0], unusual_probability)
    usual = [
        _terms(cue, cue.log_range, _own_variance(cue.log_std, cue.stature_std), cue.stature_std)
        for cue in cues
    ]
    # If every cue is an outlier, only the prior density of the range is left to integrate.
    middle = median_of(cue.log_range for cue in cues)
    all_outliers = sum(one.as_outlier for one in usual) - math.log(_UNIFORM_DENSITY)
    found = [(middle, _ALL_OUTLIERS_LOG_STD**2, 0.0, all_outliers)]
    hypotheses = [(usual, math.log1p(-unusual_probability))]
    if unusual_probability > 0.0:
        unusual = [
            _terms(
                cue,
                cue.log_range - cue.unusual_offset,
                _own_variance(cue.log_std, cue.stature_std),
                cue.unusual_std,
            )
            for cue in cues
        ]
        hypotheses.append((unusual, math.log(unusual_probability)))
    # A box's height alone is uncertain enough; its lower edge on a floor would make it sure.
    if any(math.isinf(cue.hidden_offset) for cue in cues):
        hypotheses = [
            (terms, prior + math.log1p(-_HIDDEN_PROBABILITY)) for terms, prior in hypotheses
        ]
        hidden = [_hidden_terms(cue, one) for cue, one in zip(cues, usual, strict=True)]
        hypotheses.append((hidden, math.log(_HIDDEN_PROBABILITY)))
    sided = [row for row, cue in enumerate(cues) if cue.outlier_farther != 0.5]
    for terms, prior in hypotheses:
        for inliers in _SUBSETS[len(cues)]:
            mean, own, shared, fit = _least_squares(terms, inliers)
            for row in sided:
                if not inliers[row]:
                    cue = cues[row]
                    std = math.sqrt(own + shared + cue.log_std**2)
                    beyond = _normal_share((cue.log_range - mean) / std)
                    far = cue.outlier_farther
                    fit += math.log(2.0 * (far * beyond + (1.0 - far) * (1.0 - beyond)))
            found.append((mean, own, shared, fit + prior))
    found.sort()
    highest = max(fit for *_, fit in found)
    weights = [math.exp(fit - highest) for *_, fit in found]
    total = sum(weights)
    # 1e-9: rounding must not carry the sum past a half that it reaches exactly.
    half, centre = (0.5 - 1e-9) * total, found[-1][0]
    for (mean, *_), weight in zip(found, weights, strict=True):
        half -= weight
        if half <= 0.0:
            centre = mean
            break
    own_part = lasting = 0.0
    for (mean, own, shared, _), weight in zip(found, weights, strict=True):
        own_part += weight * own
        lasting += weight * (shared + (mean - centre) ** 2)
    return CombinedRange(
        centre, math.sqrt((own_part + lasting) / total), math.sqrt(lasting / total)
    )


def _single(cue: DepthCue, unusual_probability: float) -> CombinedRange:
    usual, unusual = cue.stature_std**2, cue.unusual_std**2 + cue.unusual_offset**2
    lasting = usual + unusual_probability * (unusual - usual)
    if lasting == usual:
        return CombinedRange(cue.log_range, cue.log_std, cue.stature_std)
    own = _own_variance(cue.log_std, cue.stature_std)
    return CombinedRange(cue.log_range, math.sqrt(own + lasting), math.sqrt(lasting))


def _own_variance(log_std: float, stature_std: float) -> float:
    """Return the variance of a cue but for the person's stature."""
    return max(log_std**2 - stature_std**2, 1e-8)


def _normal_share(deviations: float) -> float:
    """Return the share of a normal distribution below this many standard deviations."""
    return 0.5 * math.erfc(-deviations / math.sqrt(2.0))


def _terms(cue: DepthCue, value: float, own: float, stature: float) -> _Terms:
    one = 1.0 / own
    return _Terms(
        one,
        one * stature,
        one * stature * stature,
        one * value,
        one * stature * value,
        one * value * value,
        math.log1p(-cue.outlier_probability) - 0.5 * math.log(2.0 * math.pi * own),
        math.log(_UNIFORM_DENSITY * cue.outlier_probability),
    )


def _hidden_terms(cue: DepthCue, usual: _Terms) -> _Terms:
    """Return the terms of a cue if the lower part of the person is hidden."""
    if not cue.hidden_offset:
        return usual
    if math.isinf(cue.hidden_offset):
        # No inlier, whatever it says.
        return usual._replace(as_inlier=-math.inf, as_outlier=math.log(_UNIFORM_DENSITY))
    own = _own_variance(cue.log_std, cue.stature_std) + _HIDDEN_STD**2
    return _terms(cue, cue.log_range - cue.hidden_offset, own, cue.stature_std)


def _least_squares(
    terms: Sequence[_Terms], inliers: Sequence[bool]
) -> tuple[float, float, float, float]:
    """Return mean, variance and log probability if exactly these cues are inliers.

    The variance comes in two parts: of the cues' own errors, and of the common stature.
    """
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
    variance, lasting = 1.0 / information, (s * shared / information) ** 2
    return mean, max(variance - lasting, 0.0), lasting, fit
