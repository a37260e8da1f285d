"""The awareness filter: a Gaussian filter in logit(α) with a lower bound.

Between measurements the belief follows an Ornstein–Uhlenbeck process towards a low prior. The
process is stationary at the prior, so uncertainty grows without evidence, but never beyond that of
the prior. Its solution is exact for any time step. The lower bound is remembered: without evidence
it may fall but never rise, however the belief moves.

Every function works on one person (numbers) or on many at once (arrays of equal shape).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import Final, TypeAlias

import numpy as np

from perception.arrays import FloatArray

from ._config import AwarenessFilterConfig

Value: TypeAlias = "float | FloatArray"

# Nodes and weights for the expectation of a function of a standard normal variable.
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(11)
_GAUSS_HERMITE_NODES: Final = _NODES
_GAUSS_HERMITE_WEIGHTS: Final = _WEIGHTS / _WEIGHTS.sum()
# Below it, exp overflows; the awareness is 0 there.
_LOWEST_LOGIT: Final = -700.0


@dataclass(frozen=True, slots=True, eq=False)
class AwarenessBelief:
    """The estimate of α for one person or many, in logit units.

    Attributes:
        mean: of logit(α).
        variance: of logit(α), > 0.
        bound: the remembered lower bound of logit(α); −∞ before the first evidence.
    """

    mean: Value
    variance: Value
    bound: Value = -math.inf


@dataclass(frozen=True, slots=True, eq=False)
class FilteredAwareness:
    """A belief in units of α.

    Attributes:
        awareness: median of α.
        awareness_std: standard deviation of α, ≤ 0.5.
        awareness_lower: one-sided lower bound of α.
    """

    awareness: Value
    awareness_std: Value
    awareness_lower: Value


def logit(awareness: Value) -> Value:
    """Return ln(α / (1 − α)) for α strictly between 0 and 1."""
    if isinstance(awareness, np.ndarray):
        return np.asarray(np.log(awareness / (1.0 - awareness)))
    return math.log(awareness / (1.0 - awareness))


def sigmoid(value: Value) -> Value:
    """Return 1 / (1 + exp(−value)), the inverse of :func:`logit`; 0 at −∞."""
    if isinstance(value, np.ndarray):
        return np.array([_sigmoid(x) for x in value.ravel().tolist()]).reshape(value.shape)
    return _sigmoid(value)


def _sigmoid(value: float) -> float:
    return 1.0 / (1.0 + math.exp(-value)) if value > _LOWEST_LOGIT else 0.0


def prior(config: AwarenessFilterConfig) -> AwarenessBelief:
    """Return the belief for a person of whom nothing is known; its lower bound is α = 0."""
    return AwarenessBelief(logit(config.prior_awareness), config.prior_std_logit**2)


def drift(
    belief: AwarenessBelief, dt_s: Value, time_constant_s: Value, config: AwarenessFilterConfig
) -> AwarenessBelief:
    """Return the belief after ``dt_s`` ≥ 0 without evidence.

    Exact for any step: φ = exp(−dt/τ), mean → m₀ + φ (mean − m₀), variance → P₀ + φ² (variance −
    P₀). The remembered bound falls to the lowest value of mean − z √variance during the step, and
    never rises.
    """
    if np.all(np.asarray(dt_s) <= 0.0):
        return belief
    prior_mean, prior_variance = logit(config.prior_awareness), config.prior_std_logit**2
    z = _quantile(config.lower_bound_confidence)
    offset, excess = belief.mean - prior_mean, belief.variance - prior_variance
    phi = np.exp(-dt_s / time_constant_s)
    mean = prior_mean + phi * offset
    variance = prior_variance + phi * phi * excess
    before = belief.mean - z * np.sqrt(belief.variance)
    after = mean - z * np.sqrt(variance)
    lowest = np.minimum(np.minimum(belief.bound, before), after)
    # If mean and variance are both below the prior's, the bound falls while the variance grows and
    # then rises towards the prior. The turning point is where its derivative by φ is zero.
    dips = (offset < 0.0) & (excess < 0.0)
    if np.any(dips):
        squared = offset * offset
        divisor = np.where(dips, z * z * excess * excess - squared * excess, 1.0)
        turn2 = np.where(dips, squared * prior_variance / divisor, 0.0)
        turns = (phi * phi < turn2) & (turn2 < 1.0)
        if np.any(turns):
            turn2 = np.where(turns, turn2, 1.0)
            spread = np.sqrt(prior_variance + turn2 * excess)
            at_turn = prior_mean + np.sqrt(turn2) * offset - z * spread
            lowest = np.where(turns, np.minimum(lowest, at_turn), lowest)
    return AwarenessBelief(mean, variance, lowest)


def evidence(
    awareness: Value, awareness_std: Value, config: AwarenessFilterConfig
) -> tuple[FloatArray, FloatArray]:
    """Return a measured α as mean and variance of logit(α).

    This is the Gaussian in logit(α) with the same one-σ points as α: α ± σ, clipped to [ε, 1 − ε].
    In mid-range its σ agrees with the logit's derivative, σ / (α (1 − α)). Near 0 and 1 the
    derivative has no bound and would give a confident "unaware" (α = 0, σ = 0.05) almost no weight.

    Mean and variance are NaN if σ exceeds ``max_evidence_std``, or if the input is NaN.
    """
    awareness, awareness_std = np.asarray(awareness), np.asarray(awareness_std)
    low, high = config.clip_awareness, 1.0 - config.clip_awareness
    below = logit(np.minimum(np.maximum(awareness - awareness_std, low), high))
    above = logit(np.minimum(np.maximum(awareness + awareness_std, low), high))
    std = np.maximum(0.5 * (above - below), config.min_evidence_std_logit)
    usable = awareness_std <= config.max_evidence_std
    return np.where(usable, 0.5 * (above + below), np.nan), np.where(usable, std * std, np.nan)


def trusted_std(awareness_std: Value, config: AwarenessFilterConfig) -> FloatArray:
    """Return the σ of α to use for a reported one: σ^w · σ_typical^(1 − w), for a reported σ ≥ 0.

    The reported σ is itself an estimate. If the logarithms of the true σ and of its error are
    normal, this is the most likely true σ, and w the first variance's share of their sum. NaN stays
    NaN, and a σ above ``max_evidence_std`` becomes NaN: it says that there is no evidence.
    """
    reported = np.asarray(awareness_std, dtype=np.float64)
    weight = config.reported_std_weight
    trusted = reported**weight * config.typical_evidence_std ** (1.0 - weight)
    return np.where(reported <= config.max_evidence_std, trusted, np.nan)


def grace_s(period_s: Value, config: AwarenessFilterConfig) -> Value:
    """Return the time after the last face in which a frame may just have missed the person.

    ``period_s`` is the usual time between frames, infinite if unknown.
    """
    if config.missed_frame_s <= 0.0:
        return 0.0
    if isinstance(period_s, np.ndarray):
        known = np.where(np.isfinite(period_s), period_s, 0.0)
        return np.maximum(config.missed_frame_s, np.minimum(known, config.max_evidence_gap_s))
    known_s = period_s if math.isfinite(period_s) else 0.0
    return max(config.missed_frame_s, min(known_s, config.max_evidence_gap_s))


def drift_unseen(
    belief: AwarenessBelief,
    from_s: float,
    to_s: float,
    evidence_stamps_s: FloatArray,
    period_s: Value,
    config: AwarenessFilterConfig,
) -> AwarenessBelief:
    """Return the belief at ``to_s`` ≥ ``from_s`` if no frame in between shows the person.

    A single missed frame costs little: until the last face is :func:`grace_s` ago the belief drifts
    as between two faces, then with ``unseen_time_constant_s`` (or ``memory_s``, if longer). The
    bound falls throughout, and the result does not depend on frames in between.

    Args:
        belief: (N,) at ``from_s``.
        from_s: stamp of the belief.
        to_s: stamp of the result.
        evidence_stamps_s: (N,) stamps of the last face; NaN for none.
        period_s: usual time between frames.
        config: settings.
    """
    unseen_s = max(config.unseen_time_constant_s, config.memory_s)
    slow_s = max(config.evidence_time_constant_s, unseen_s)
    left_s = evidence_stamps_s + grace_s(period_s, config) - from_s
    # fmax takes the 0 where there was no face.
    slow_until_s = np.minimum(np.fmax(left_s, 0.0), to_s - from_s)
    belief = drift(belief, slow_until_s, slow_s, config)
    return drift(belief, to_s - from_s - slow_until_s, unseen_s, config)


def measure(
    belief: AwarenessBelief,
    mean: Value,
    variance: Value,
    interval_s: Value,
    config: AwarenessFilterConfig,
) -> AwarenessBelief:
    """Return the belief after one measurement of logit(α), which also sets the remembered bound.

    Args:
        belief: at the time of the measurement.
        mean: of the measurement, from :func:`evidence`.
        variance: of the measurement, from :func:`evidence`.
        interval_s: > 0, time that this measurement stands for. Below ``evidence_correlation_s`` the
            variance is increased in proportion, so that the information per second has a limit.
        config: settings.
    """
    factor = config.evidence_correlation_s / interval_s
    many = isinstance(factor, np.ndarray)
    effective = variance * (np.maximum(1.0, factor) if many else max(1.0, factor))
    gain = belief.variance / (belief.variance + effective)
    corrected = belief.mean + gain * (mean - belief.mean)
    remaining = belief.variance * (1.0 - gain)
    z = _quantile(config.lower_bound_confidence)
    return AwarenessBelief(corrected, remaining, corrected - z * np.sqrt(remaining))


def forget(belief: AwarenessBelief, config: AwarenessFilterConfig) -> AwarenessBelief:
    """Return the prior, with the lower of the belief's bound and the prior's bound."""
    fresh = prior(config)
    prior_bound = fresh.mean - _quantile(config.lower_bound_confidence) * config.prior_std_logit
    bound = np.minimum(belief.bound, prior_bound)
    return AwarenessBelief(fresh.mean, fresh.variance, bound)


def estimate(belief: AwarenessBelief, config: AwarenessFilterConfig) -> FilteredAwareness:
    """Return a belief in units of α.

    The awareness is sigmoid(mean), the median of the logit-normal distribution. The standard
    deviation is that of the distribution by Gauss–Hermite quadrature, so it never exceeds 0.5. The
    lower bound is (sigmoid(bound) − ε) / (1 − ε), at least 0: measurements are clipped at ε, so a
    bound of ε or less is the same as 0.
    """
    mean, std = np.asarray(belief.mean), np.sqrt(belief.variance)
    # The sigmoid is (1 + tanh(x / 2)) / 2, and tanh is faster on arrays.
    values = np.tanh((0.5 * mean)[..., None] + (0.5 * std)[..., None] * _GAUSS_HERMITE_NODES)
    # Sums along the last axis do not depend on the number of people.
    deviation = values - (values * _GAUSS_HERMITE_WEIGHTS).sum(axis=-1)[..., None]
    second = (deviation * deviation * _GAUSS_HERMITE_WEIGHTS).sum(axis=-1)
    clip = config.clip_awareness
    lower = np.maximum((sigmoid(belief.bound) - clip) / (1.0 - clip), 0.0)
    return FilteredAwareness(sigmoid(belief.mean), 0.5 * np.sqrt(second), lower)


@lru_cache(maxsize=32)
def _quantile(confidence: float) -> float:
    return NormalDist().inv_cdf(confidence)
