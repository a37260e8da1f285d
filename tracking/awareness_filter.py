"""The awareness filter: a Gaussian filter in logit(α) with a lower bound.

Between measurements the belief follows an Ornstein–Uhlenbeck process towards a low prior. The
process is stationary at the prior, so uncertainty grows without evidence, but never beyond that of
the prior. Its solution is exact for any time step. The lower bound is remembered: without evidence
it may fall but never rise, however the belief moves.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from ._config import AwarenessFilterConfig

# Nodes and weights for the expectation of a function of a standard normal variable.
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(9)
_GAUSS_HERMITE: Final = tuple(
    zip(_NODES.tolist(), (_WEIGHTS / _WEIGHTS.sum()).tolist(), strict=True)
)
# Below it, exp overflows; the awareness is 0 there.
_LOWEST_LOGIT: Final = -700.0
#: Two frames with a face further apart than this are no evidence for the time between them: 5 Hz,
#: the slowest rate at which awareness builds up, with some room.
EVIDENCE_GAP_S: Final = 0.25
# α of a person of whom nothing is known, and its standard deviation in logit(α): wide enough for
# one turn of the head, about six units.
_PRIOR_AWARENESS: Final = 0.05
_PRIOR_STD: Final = 2.0
# Errors of α this close in time count as one. So a faster camera, or one that repeats frames, adds
# no certainty: the information per second has a limit.
_CORRELATION_S: Final = 0.1
# ε: α is clipped to [ε, 1 − ε] before the logit.
_CLIP: Final = 0.02
# Smallest standard deviation of a measurement in logit(α).
_LEAST_STD: Final = 0.3
# The standard deviation of α that a measurement usually has, and the weight of the reported one
# against it. Half is right if σ differs between measurements by as large a factor as it is wrong.
_TYPICAL_STD: Final = 0.1
_REPORTED_WEIGHT: Final = 0.6
# 1/√12: the standard deviation of the uniform distribution on [0, 1], which says nothing.
_MOST_STD: Final = 0.29


class AwarenessBelief(NamedTuple):
    """The estimate of α for one person, in logit units.

    Attributes:
        mean: of logit(α).
        variance: of logit(α), > 0.
        bound: the remembered lower bound of logit(α); −∞ before the first evidence.
    """

    mean: float
    variance: float
    bound: float = -math.inf


class Evidence(NamedTuple):
    """A measured α as a normal distribution of logit(α).

    Attributes:
        mean: of logit(α).
        variance: of logit(α), > 0.
    """

    mean: float
    variance: float


class FilteredAwareness(NamedTuple):
    """A belief in units of α.

    Attributes:
        awareness: median of α.
        awareness_std: standard deviation of α, ≤ 0.5.
        awareness_lower: one-sided lower bound of α.
    """

    awareness: float
    awareness_std: float
    awareness_lower: float


def logit(awareness: float) -> float:
    """Return ln(α / (1 − α)) for α strictly between 0 and 1."""
    return math.log(awareness / (1.0 - awareness))


def sigmoid(value: float) -> float:
    """Return 1 / (1 + exp(−value)), the inverse of :func:`logit`; 0 at −∞."""
    return 1.0 / (1.0 + math.exp(-value)) if value > _LOWEST_LOGIT else 0.0


#: The belief for a person of whom nothing is known; its lower bound is α = 0.
PRIOR: Final = AwarenessBelief(logit(_PRIOR_AWARENESS), _PRIOR_STD**2)


def drift(
    belief: AwarenessBelief, dt_s: float, time_constant_s: float, config: AwarenessFilterConfig
) -> AwarenessBelief:
    """Return the belief after ``dt_s`` ≥ 0 without evidence.

    Exact for any step: φ = exp(−dt/τ), mean → m₀ + φ (mean − m₀), variance → P₀ + φ² (variance −
    P₀). The remembered bound falls to the lowest value of mean − z √variance during the step, and
    never rises.
    """
    if dt_s <= 0.0:
        return belief
    (prior_mean, prior_variance, _), z = PRIOR, config.bound_sigmas
    offset, excess = belief.mean - prior_mean, belief.variance - prior_variance
    phi = math.exp(-dt_s / time_constant_s)
    phi2 = phi * phi
    mean = prior_mean + phi * offset
    variance = prior_variance + phi2 * excess
    before = belief.mean - z * math.sqrt(belief.variance)
    lowest = min(belief.bound, before, mean - z * math.sqrt(variance))
    if offset < 0.0 and excess < 0.0:
        # The bound falls while the variance grows and then rises towards the prior. The turning
        # point is where its derivative by φ is zero.
        squared = offset * offset
        turn2 = squared * prior_variance / (z * z * excess * excess - squared * excess)
        if phi2 < turn2 < 1.0:
            spread = math.sqrt(prior_variance + turn2 * excess)
            lowest = min(lowest, prior_mean + math.sqrt(turn2) * offset - z * spread)
    return AwarenessBelief(mean, variance, lowest)


def evidence(awareness: float | None, awareness_std: float | None) -> Evidence | None:
    """Return a measured α as mean and variance of logit(α).

    This is the Gaussian in logit(α) with the same one-σ points as α: α ± σ, clipped to [ε, 1 − ε].
    In mid-range its σ agrees with the logit's derivative, σ / (α (1 − α)). Near 0 and 1 the
    derivative has no bound and would give a confident "unaware" (α = 0, σ = 0.05) almost no weight.

    None, no evidence, without α or if σ exceeds 0.29, as if α were uniform on [0, 1].
    """
    if awareness is None or awareness_std is None or awareness_std > _MOST_STD:
        return None
    low, high = _CLIP, 1.0 - _CLIP
    below = logit(min(max(awareness - awareness_std, low), high))
    above = logit(min(max(awareness + awareness_std, low), high))
    std = max(0.5 * (above - below), _LEAST_STD)
    return Evidence(0.5 * (above + below), std * std)


def trusted_std(awareness_std: float | None) -> float | None:
    """Return the σ of α to use for a reported one: σ^w · σ_typical^(1 − w), for a reported σ ≥ 0.

    The reported σ is itself an estimate. If the logarithms of the true σ and of its error are
    normal, this is the most likely true σ, and w the first variance's share of their sum. None
    stays None, and a σ above 0.29 becomes None: it says that there is no evidence.
    """
    if awareness_std is None or awareness_std > _MOST_STD:
        return None
    return float(awareness_std**_REPORTED_WEIGHT * _TYPICAL_STD ** (1.0 - _REPORTED_WEIGHT))


def grace_s(period_s: float, config: AwarenessFilterConfig) -> float:
    """Return the time after the last face in which a frame may just have missed the person.

    ``period_s`` is the usual time between frames, infinite if unknown.
    """
    if config.missed_frame_s <= 0.0:
        return 0.0
    known_s = period_s if math.isfinite(period_s) else 0.0
    return max(config.missed_frame_s, min(known_s, EVIDENCE_GAP_S))


def drift_unseen(
    belief: AwarenessBelief,
    from_s: float,
    to_s: float,
    face_s: float,
    period_s: float,
    config: AwarenessFilterConfig,
) -> AwarenessBelief:
    """Return the belief at ``to_s`` ≥ ``from_s`` if no frame in between shows the person.

    A single missed frame costs little: until the last face is :func:`grace_s` ago the belief drifts
    as between two faces, then with ``unseen_time_constant_s``. The bound falls throughout, and the
    result does not depend on frames in between.

    Args:
        belief: at ``from_s``.
        from_s: stamp of the belief.
        to_s: stamp of the result.
        face_s: stamp of the last face; −∞ for none.
        period_s: usual time between frames.
        config: settings.
    """
    slow_until_s = min(max(face_s + grace_s(period_s, config) - from_s, 0.0), to_s - from_s)
    belief = drift(belief, slow_until_s, config.evidence_time_constant_s, config)
    return drift(belief, to_s - from_s - slow_until_s, config.unseen_time_constant_s, config)


def measure(
    belief: AwarenessBelief, measured: Evidence, interval_s: float, config: AwarenessFilterConfig
) -> AwarenessBelief:
    """Return the belief after one measurement of logit(α), which also sets the remembered bound.

    Args:
        belief: at the time of the measurement.
        measured: from :func:`evidence`.
        interval_s: > 0, time that this measurement stands for. Below 0.1 s the
            variance is increased in proportion, so that the information per second has a limit.
        config: settings.
    """
    effective = measured.variance * max(1.0, _CORRELATION_S / interval_s)
    gain = belief.variance / (belief.variance + effective)
    corrected = belief.mean + gain * (measured.mean - belief.mean)
    remaining = belief.variance * (1.0 - gain)
    bound = corrected - config.bound_sigmas * math.sqrt(remaining)
    return AwarenessBelief(corrected, remaining, bound)


def forget(belief: AwarenessBelief, config: AwarenessFilterConfig) -> AwarenessBelief:
    """Return the prior, with the lower of the belief's bound and the prior's bound."""
    prior_bound = PRIOR.mean - config.bound_sigmas * _PRIOR_STD
    return PRIOR._replace(bound=min(belief.bound, prior_bound))


def estimate(belief: AwarenessBelief) -> FilteredAwareness:
    """Return a belief in units of α.

    The awareness is sigmoid(mean), the median of the logit-normal distribution. The standard
    deviation is that of the distribution by Gauss–Hermite quadrature, so it never exceeds 0.5. The
    lower bound is (sigmoid(bound) − ε) / (1 − ε), at least 0: measurements are clipped at ε, so a
    bound of ε or less is the same as 0.
    """
    # The sigmoid is (1 + tanh(x / 2)) / 2.
    half, spread = 0.5 * belief.mean, 0.5 * math.sqrt(belief.variance)
    middle = math.tanh(half)
    mean = second = 0.0
    for node, weight in _GAUSS_HERMITE:
        # Relative to the median, so that a narrow belief keeps its digits.
        value = math.tanh(half + spread * node) - middle
        mean += weight * value
        second += weight * value * value
    lower = max((sigmoid(belief.bound) - _CLIP) / (1.0 - _CLIP), 0.0)
    return FilteredAwareness(
        sigmoid(belief.mean), 0.5 * math.sqrt(max(second - mean * mean, 0.0)), lower
    )
