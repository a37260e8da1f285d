"""Awareness filters that were tried, all on the same measurements.

Each takes stamps (T,) and measurements (T, N) and returns awareness and its lower bound, (T, N).
None of them handles new or mistaken tracks. The tracker's own filter is judged through the tracker.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Final, TypeAlias

import numpy as np

from tracking import AwarenessFilterConfig
from tracking import awareness_filter as gaussian

from ._attention import BoolArray, FloatArray
from ._camera import Measured

Filter: TypeAlias = Callable[[FloatArray, Measured], tuple[FloatArray, FloatArray]]

#: Quantile of the one-sided lower bound.
Z: Final = NormalDist().inv_cdf(0.9)


def hold_latest(stamps_s: FloatArray, measured: Measured) -> tuple[FloatArray, FloatArray]:
    """Return the latest measurement and its bound α − zσ, held until the next: a bad idea."""
    alpha = measured.awareness.copy()
    lower = np.maximum(alpha - Z * measured.awareness_std, 0.0)
    for row in range(len(stamps_s)):
        before = row - 1 if row else None
        gap = np.isnan(alpha[row])
        alpha[row, gap] = 0.0 if before is None else alpha[before, gap]
        lower[row, gap] = 0.0 if before is None else lower[before, gap]
    return alpha, lower


@dataclass(frozen=True)
class Smoothed:
    """Exponential smoothing of α and of its variance, towards 0 without evidence."""

    time_constant_s: float = 0.2

    def __call__(self, stamps_s: FloatArray, measured: Measured) -> tuple[FloatArray, FloatArray]:
        """Run over all frames."""
        alpha = np.zeros_like(measured.awareness)
        lower = np.zeros_like(alpha)
        spread = np.full(alpha.shape[1], 0.25)
        for row in range(1, len(stamps_s)):
            keep = math.exp(-(stamps_s[row] - stamps_s[row - 1]) / self.time_constant_s)
            shown = ~np.isnan(measured.awareness[row])
            new = np.where(shown, measured.awareness[row], 0.0)
            own = np.where(shown, measured.awareness_std[row], 0.5)
            alpha[row] = keep * alpha[row - 1] + (1.0 - keep) * new
            spread = keep * spread + (1.0 - keep) * (own**2 + (new - alpha[row]) ** 2)
            bound = np.maximum(alpha[row] - Z * np.sqrt(spread), 0.0)
            lower[row] = np.where(shown, bound, np.minimum(bound, lower[row - 1]))
        return alpha, lower


@dataclass(frozen=True)
class LogitGaussian:
    """The tracker's filter, and variations of it.

    Attributes:
        config: settings.
        reset_below_sigmas: a measurement this many σ below the expected one resets the belief to
            the prior before it counts (quick down, slow up); infinite for never.
        reset_above_sigmas: a measurement this many σ above the expected one resets the belief to
            the prior and does not count itself (a jump takes two frames); infinite for never.
        bias_std_logit: standard deviation of an error that lasts for ``bias_s``, estimated beside
            logit(α); 0 for none.
        bias_s: time constant of that error.
    """

    config: AwarenessFilterConfig = field(default_factory=AwarenessFilterConfig)
    reset_below_sigmas: float = math.inf
    reset_above_sigmas: float = math.inf
    bias_std_logit: float = 0.0
    bias_s: float = 0.3

    def __call__(self, stamps_s: FloatArray, measured: Measured) -> tuple[FloatArray, FloatArray]:
        """Run over all frames."""
        config = self.config
        shape = measured.awareness.shape
        alpha, lower = np.empty(shape), np.empty(shape)
        start = gaussian.prior(config)
        belief = gaussian.AwarenessBelief(
            np.full(shape[1], start.mean),
            np.full(shape[1], start.variance),
            np.full(shape[1], -math.inf),
        )
        lasting = _LastingBias(shape[1], self.bias_std_logit**2, self.bias_s)
        stds = gaussian.trusted_std(measured.awareness_std, config)
        means, variances = gaussian.evidence(measured.awareness, stds, config)
        evident_s = np.full(shape[1], np.nan)
        # As in the tracker, the time between frames is not known before there are two.
        period_s = float(stamps_s[1] - stamps_s[0])
        for row, stamp_s in enumerate(stamps_s):
            dt_s = float(stamp_s - stamps_s[row - 1]) if row else 0.0
            shown = ~np.isnan(means[row])
            continued = shown & (stamp_s - evident_s <= config.max_evidence_gap_s)
            faceless = measured.seen[row] & ~shown
            constants_s = np.where(
                continued, config.evidence_time_constant_s, config.no_face_time_constant_s
            )
            known = gaussian.drift(belief, dt_s, constants_s, config)
            unknown = gaussian.drift_unseen(
                belief,
                float(stamp_s) - dt_s,
                float(stamp_s),
                evident_s,
                period_s if row > 1 else math.inf,
                config,
            )
            belief = _choose(continued | faceless, known, unknown)
            evident_s = np.where(shown, stamp_s, np.where(faceless, np.nan, evident_s))
            mean = np.where(shown, means[row], 0.0)
            variance = np.where(shown, variances[row], 1.0)
            if self.bias_std_logit > 0.0:
                lasting.drift(dt_s, constants_s)
                after = lasting.measure(belief, mean, variance, shown)
            else:
                after = self._measure(belief, mean, variance, dt_s if row else math.inf)
            belief = _choose(shown, after, belief)
            estimate = gaussian.estimate(belief, config)
            alpha[row], lower[row] = estimate.awareness, estimate.awareness_lower
        return alpha, lower

    def _measure(
        self,
        belief: gaussian.AwarenessBelief,
        mean: FloatArray,
        variance: FloatArray,
        interval_s: float,
    ) -> gaussian.AwarenessBelief:
        config = self.config
        spread = np.sqrt(belief.variance + variance)
        reset = gaussian.forget(belief, config)
        high = mean > belief.mean + self.reset_above_sigmas * spread
        belief = _choose(mean < belief.mean - self.reset_below_sigmas * spread, reset, belief)
        return _choose(high, reset, gaussian.measure(belief, mean, variance, interval_s, config))


class _LastingBias:
    """An error that measurements share for a while: a second state beside logit(α)."""

    def __init__(self, people: int, variance: float, time_constant_s: float) -> None:
        self._stationary, self._time_constant_s = variance, time_constant_s
        self._mean, self._shared = np.zeros(people), np.zeros(people)
        self._variance = np.full(people, variance)

    def drift(self, dt_s: float, constants_s: FloatArray) -> None:
        keep = math.exp(-dt_s / self._time_constant_s)
        self._mean = self._mean * keep
        self._shared = self._shared * keep * np.exp(-dt_s / constants_s)
        self._variance = self._stationary + keep**2 * (self._variance - self._stationary)

    def measure(
        self,
        belief: gaussian.AwarenessBelief,
        mean: FloatArray,
        variance: FloatArray,
        shown: BoolArray,
    ) -> gaussian.AwarenessBelief:
        total = belief.variance + 2.0 * self._shared + self._variance + variance
        gain = (belief.variance + self._shared) / total
        own_gain = np.where(shown, (self._variance + self._shared) / total, 0.0)
        innovation = mean - belief.mean - self._mean
        corrected = belief.mean + gain * innovation
        remaining = belief.variance - gain * (belief.variance + self._shared)
        covariance = self._shared - gain * (self._variance + self._shared)
        self._mean = self._mean + own_gain * innovation
        self._variance = self._variance - own_gain * (self._variance + self._shared)
        self._shared = np.where(shown, covariance, self._shared)
        bound = corrected - Z * np.sqrt(remaining)
        return gaussian.AwarenessBelief(corrected, remaining, bound)


@dataclass(frozen=True)
class PlainLogit:
    """A Kalman filter of logit(α) as a random walk, without a prior to return to: a simple peer.

    The variance of a measurement is (σ / (α (1 − α)))², with the σ as reported.

    Attributes:
        density_ps: spectral density of the random walk in logit²/s.
        clip: α is clipped to [clip, 1 − clip].
    """

    density_ps: float = 8.0
    clip: float = 0.02

    def __call__(self, stamps_s: FloatArray, measured: Measured) -> tuple[FloatArray, FloatArray]:
        """Run over all frames."""
        shape = measured.awareness.shape
        alpha, lower = np.empty(shape), np.empty(shape)
        mean, variance = np.full(shape[1], -3.0), np.full(shape[1], 4.0)
        bound = np.zeros(shape[1])
        for row in range(len(stamps_s)):
            dt_s = float(stamps_s[row] - stamps_s[row - 1]) if row else 0.0
            shown = ~np.isnan(measured.awareness[row])
            variance = np.minimum(variance + self.density_ps * dt_s, 16.0)
            clipped = np.clip(measured.awareness[row], self.clip, 1.0 - self.clip)
            clipped = np.where(shown, clipped, 0.5)
            std = np.where(shown, measured.awareness_std[row], 1.0) / (clipped * (1.0 - clipped))
            gain = np.where(shown, variance / (variance + std * std), 0.0)
            mean = mean + gain * (np.log(clipped / (1.0 - clipped)) - mean)
            variance = variance * (1.0 - gain)
            own = np.asarray(gaussian.sigmoid(mean - Z * np.sqrt(variance)))
            bound = np.where(shown, own, np.minimum(own, bound))
            alpha[row], lower[row] = gaussian.sigmoid(mean), bound
        return alpha, lower


@dataclass(frozen=True)
class HistogramFilter:
    """A histogram filter of α with jumps: gaze stays constant between sudden changes.

    Between frames a share 1 − exp(−dt/τ) of the belief is replaced by the distribution of people's
    α (with evidence) or by the prior (without); exact for any dt. A measurement is an outlier with
    a small probability. With two bins it is the two-state hidden Markov model of aware and unaware.

    Attributes:
        bins: number of levels of α, the first of which is 0.
        stay_s: τ with evidence.
        unseen_s: τ without evidence.
        correlation_s: frames closer than this count in part (likelihood to the power dt / this).
        outliers: probability that a measurement is an outlier.
        least_std: least σ of a measurement.
    """

    bins: int = 21
    stay_s: float = 0.6
    unseen_s: float = 0.2
    correlation_s: float = 0.15
    outliers: float = 0.03
    least_std: float = 0.06

    def __call__(self, stamps_s: FloatArray, measured: Measured) -> tuple[FloatArray, FloatArray]:
        """Run over all frames."""
        if self.bins == 2:
            levels, extra, usual = np.array([0.0, 0.8]), 0.12, np.array([0.5, 0.5])
            prior = np.array([0.95, 0.05])
        else:
            levels, extra = np.linspace(0.0, 1.0, self.bins), 0.0
            usual = np.full(self.bins, 0.5 / (self.bins - 1))
            usual[0] = 0.5
            prior = np.where(levels == 0.0, 0.9, 0.1 / (self.bins - 1))
        belief = np.tile(prior, (measured.awareness.shape[1], 1))
        alpha = np.zeros_like(measured.awareness)
        lower = np.zeros_like(alpha)
        for row in range(1, len(stamps_s)):
            dt_s = float(stamps_s[row] - stamps_s[row - 1])
            shown = ~np.isnan(measured.awareness[row])
            keep = np.exp(-dt_s / np.where(shown, self.stay_s, self.unseen_s))[:, None]
            fresh = np.where(shown[:, None], usual, prior)
            belief = keep * belief + (1.0 - keep) * fresh
            measured_alpha = np.where(shown, measured.awareness[row], 0.0)[:, None]
            std = np.where(shown, measured.awareness_std[row], 1.0)[:, None]
            std = np.sqrt(np.maximum(std, self.least_std) ** 2 + extra**2)
            density = np.exp(-0.5 * ((measured_alpha - levels) / std) ** 2) / (
                std * math.sqrt(2 * math.pi)
            )
            likelihood = (1.0 - self.outliers) * density + self.outliers
            power = min(1.0, dt_s / self.correlation_s) if self.correlation_s else 1.0
            belief = np.where(shown[:, None], belief * likelihood**power, belief)
            belief /= belief.sum(axis=1, keepdims=True)
            alpha[row] = belief @ levels
            if self.bins == 2:
                bound = belief[:, 1]
            else:
                # The tenth percentile of the belief.
                bound = levels[(np.cumsum(belief, axis=1) > 0.1).argmax(axis=1)]
            lower[row] = np.where(shown, bound, np.minimum(bound, lower[row - 1]))
        return alpha, lower


def _choose(
    mask: BoolArray, first: gaussian.AwarenessBelief, second: gaussian.AwarenessBelief
) -> gaussian.AwarenessBelief:
    return gaussian.AwarenessBelief(
        np.where(mask, first.mean, second.mean),
        np.where(mask, first.variance, second.variance),
        np.where(mask, first.bound, second.bound),
    )
