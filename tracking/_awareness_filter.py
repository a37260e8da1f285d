"""Awareness over time: a scalar Gaussian filter in logit(α) with a lower bound that keeps its word.

Between measurements the belief follows an Ornstein–Uhlenbeck process towards a low prior. It is
stationary at the prior, so uncertainty grows while nothing is known but never beyond the prior's,
and its solution is exact for any time step. The lower bound is remembered: without evidence it may
fall, never rise, however the belief moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import Final

import numpy as np

from ._config import AwarenessFilterConfig

# Nodes and weights for the expectation of a function of a standard normal variable.
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(11)
_GAUSS_HERMITE: Final = tuple(
    zip(_NODES.tolist(), (_WEIGHTS / _WEIGHTS.sum()).tolist(), strict=True)
)


@dataclass(frozen=True, slots=True)
class AwarenessBelief:
    """What is believed of one person's α, in logit units.

    Attributes:
        mean: of logit(α).
        variance: of logit(α), > 0.
        bound: the remembered lower bound of logit(α); −∞ until evidence has lifted it.
    """

    mean: float
    variance: float
    bound: float = -math.inf


@dataclass(frozen=True, slots=True)
class AwarenessEstimate:
    """A belief in units of α: median, standard deviation (≤ 0.5) and one-sided lower bound."""

    awareness: float
    awareness_std: float
    awareness_lower: float


def logit(awareness: float) -> float:
    """Return ln(α / (1 − α)) for α strictly between 0 and 1."""
    return math.log(awareness / (1.0 - awareness))


def sigmoid(value: float) -> float:
    """Return 1 / (1 + exp(−value)), the inverse of :func:`logit`; 0 at −∞."""
    if value >= 0.0:
        return 1.0 / (1.0 + math.exp(-value))
    scaled = math.exp(value)
    return scaled / (1.0 + scaled)


def prior(config: AwarenessFilterConfig) -> AwarenessBelief:
    """Return the belief about a person of whom nothing is known; its lower bound is α = 0."""
    return AwarenessBelief(logit(config.prior_awareness), config.prior_std_logit**2)


def drift(
    belief: AwarenessBelief, dt_s: float, time_constant_s: float, config: AwarenessFilterConfig
) -> AwarenessBelief:
    """Return the belief after ``dt_s`` ≥ 0 without evidence.

    Exact for any step: φ = exp(−dt/τ), mean → m₀ + φ (mean − m₀), variance → P₀ + φ² (variance −
    P₀). The remembered bound becomes the lowest value that mean − z √variance takes on the way.
    """
    if dt_s <= 0.0:
        return belief
    prior_mean, prior_variance = logit(config.prior_awareness), config.prior_std_logit**2
    z = _quantile(config.lower_bound_confidence)
    offset, excess = belief.mean - prior_mean, belief.variance - prior_variance

    def bound_at(phi: float) -> float:
        variance = max(prior_variance + phi * phi * excess, 0.0)
        return prior_mean + phi * offset - z * math.sqrt(variance)

    phi = math.exp(-dt_s / time_constant_s)
    lowest = min(belief.bound, bound_at(1.0), bound_at(phi))
    if offset < 0.0 and excess < 0.0:
        # A belief surer and lower than the prior dips while its variance grows and then climbs
        # towards the prior: setting the derivative by φ to zero gives the turning point.
        turn2 = offset**2 * prior_variance / (z * z * excess * excess - offset**2 * excess)
        if phi * phi < turn2 < 1.0:
            lowest = min(lowest, bound_at(math.sqrt(turn2)))
    return AwarenessBelief(prior_mean + phi * offset, prior_variance + phi * phi * excess, lowest)


def evidence(
    awareness: float, awareness_std: float, config: AwarenessFilterConfig
) -> tuple[float, float] | None:
    """Return a measured α as (mean, variance) of logit(α), or None when it says too little.

    The Gaussian in logit(α) whose two one-σ points are those of α, α ± σ clipped to [ε, 1 − ε]. In
    mid-range that is the logit's derivative, σ / (α (1 − α)); near 0 and 1 the derivative has no
    bound and would turn a confident "unaware" (α = 0, σ = 0.05) into next to nothing.
    """
    if awareness_std > config.max_evidence_std:
        return None
    low, high = config.clip_awareness, 1.0 - config.clip_awareness
    below = logit(min(max(awareness - awareness_std, low), high))
    above = logit(min(max(awareness + awareness_std, low), high))
    std = max(0.5 * (above - below), config.min_evidence_std_logit)
    return 0.5 * (above + below), std * std


def measure(
    belief: AwarenessBelief,
    mean: float,
    variance: float,
    interval_s: float,
    config: AwarenessFilterConfig,
) -> AwarenessBelief:
    """Return the belief after one measurement of logit(α) and reset the remembered bound by it.

    Args:
        belief: at the instant of the measurement.
        mean: of the measurement, from :func:`evidence`.
        variance: of the measurement, from :func:`evidence`.
        interval_s: > 0, time that this measurement stands for; below ``evidence_correlation_s``
            the variance grows in proportion, so that information per second has a limit.
        config: settings.
    """
    effective = variance * max(1.0, config.evidence_correlation_s / interval_s)
    gain = belief.variance / (belief.variance + effective)
    corrected = belief.mean + gain * (mean - belief.mean)
    remaining = belief.variance * (1.0 - gain)
    z = _quantile(config.lower_bound_confidence)
    return AwarenessBelief(corrected, remaining, corrected - z * math.sqrt(remaining))


def forget(belief: AwarenessBelief, config: AwarenessFilterConfig) -> AwarenessBelief:
    """Return the prior, with a lower bound no higher than the belief's or the prior's own."""
    fresh = prior(config)
    own = fresh.mean - _quantile(config.lower_bound_confidence) * config.prior_std_logit
    return AwarenessBelief(fresh.mean, fresh.variance, min(belief.bound, own))


def estimate(belief: AwarenessBelief) -> AwarenessEstimate:
    """Return a belief in units of α.

    The awareness is sigmoid(mean), the median of the logit-normal distribution; the standard
    deviation is that of the distribution by Gauss–Hermite quadrature, so it never exceeds 0.5.
    """
    std = math.sqrt(belief.variance)
    first = second = 0.0
    for node, weight in _GAUSS_HERMITE:
        value = sigmoid(belief.mean + std * node)
        first += weight * value
        second += weight * value * value
    return AwarenessEstimate(
        sigmoid(belief.mean),
        math.sqrt(max(second - first * first, 0.0)),
        sigmoid(belief.bound),
    )


@lru_cache(maxsize=32)
def _quantile(confidence: float) -> float:
    return NormalDist().inv_cdf(confidence)
