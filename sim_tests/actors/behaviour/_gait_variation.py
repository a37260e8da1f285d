"""Variation of a walk about its desired velocity: pace, wandering, sway and steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

# The variation follows the speed with this time constant.
_SHARE_S: Final = 0.4


@dataclass(frozen=True, slots=True)
class VariationFigures:
    """Figures of the variation, as fitted to recorded people.

    A wandering velocity is a smooth random process: white noise through two equal low-pass filters.

    Attributes:
        pace_mps: standard deviation of the pace, along the path.
        pace_s: time constant of its filters.
        wander_mps: standard deviation of the velocity across the path.
        wander_s: time constant of its filters.
        sway_m: median amplitude of the sway from foot to foot, across the path.
        sway_sigma: standard deviation of the amplitude's logarithm, between people.
        stride_hz: mean frequency of the stride at 1.3 m/s, two steps.
        stride_sigma: standard deviation of the frequency's logarithm, between people.
        step_mps: median amplitude of the velocity along the path with each step.
    """

    pace_mps: float
    pace_s: float
    wander_mps: float
    wander_s: float
    sway_m: float
    sway_sigma: float
    stride_hz: float
    stride_sigma: float
    step_mps: float


class GaitVariation:
    """The variation of one person's walk, and its rate of change.

    Args:
        figures: of the population.
        rng: the person's own generator.
    """

    def __init__(self, figures: VariationFigures, rng: np.random.Generator) -> None:
        self._figures, self._rng = figures, rng
        spread = math.exp(figures.sway_sigma * rng.standard_normal())
        self._sway_m, self._step_mps = figures.sway_m * spread, figures.step_mps * spread
        self._stride_radps = (
            math.tau * figures.stride_hz * math.exp(figures.stride_sigma * rng.standard_normal())
        )
        self._phase, self._step_phase = rng.uniform(0.0, math.tau, 2).tolist()
        self._pace = _SmoothNoise(figures.pace_mps, figures.pace_s, rng)
        self._wander = _SmoothNoise(figures.wander_mps, figures.wander_s, rng)
        self._share = 0.0
        self._last = (0.0, 0.0)

    def step(self, dt_s: float, share: float) -> tuple[float, float, float, float]:
        """Return velocity along and across the path, in m/s, and both accelerations, in m/s².

        Args:
            dt_s: time since the last call.
            share: the desired speed relative to the free speed; 0 stands still.
        """
        self._share += (1.0 - math.exp(-dt_s / _SHARE_S)) * (min(share, 1.0) - self._share)
        share = self._share
        # The frequency of steps grows with the square root of speed.
        self._phase += self._stride_radps * math.sqrt(share) * dt_s
        along = self._pace.step(dt_s) + self._step_mps * math.sin(
            2.0 * self._phase + self._step_phase
        )
        sway_mps = self._sway_m * self._stride_radps * math.cos(self._phase)
        across = self._wander.step(dt_s) + sway_mps
        before, self._last = self._last, (share * along, share * across)
        now = self._last
        return *now, (now[0] - before[0]) / dt_s, (now[1] - before[1]) / dt_s


class _SmoothNoise:
    """A velocity that wanders: white noise through two equal low-pass filters."""

    def __init__(self, std_mps: float, time_s: float, rng: np.random.Generator) -> None:
        self._std_mps, self._time_s, self._rng = std_mps, time_s, rng
        # Stationary from the start: the two filters in series have variances 1 and 1/2, and the
        # covariance 1/2.
        first, second = (float(rng.standard_normal()) for _ in range(2))
        self._first: float = first
        self._second = 0.5 * first + 0.5 * second

    def step(self, dt_s: float) -> float:
        keep = math.exp(-dt_s / self._time_s)
        self._first = keep * self._first + math.sqrt(1.0 - keep * keep) * float(
            self._rng.standard_normal()
        )
        self._second += (1.0 - keep) * (self._first - self._second)
        return float(math.sqrt(2.0) * self._std_mps * self._second)
