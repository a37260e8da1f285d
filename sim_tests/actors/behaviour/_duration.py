"""Durations whose logarithm is normally distributed, as people's looks and delays are."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ...world.errors import SimError

#: The upper quartile of a standard normal distribution.
UPPER_QUARTILE: Final = 0.6744897501960817


@dataclass(frozen=True, slots=True)
class LogNormalDuration:
    """A duration whose logarithm is normally distributed.

    Attributes:
        median_s: > 0.
        sigma: standard deviation of the logarithm, ≥ 0.
    """

    median_s: float
    sigma: float

    @classmethod
    def fitted(cls, median_s: float, quartiles_s: tuple[float, float]) -> LogNormalDuration:
        """Fit the median and the ratio of the quartiles.

        The quartiles of a lognormal lie at median · exp(±0.6745 σ), so their ratio gives σ. The
        fitted quartiles equal the given ones only if those lie evenly around the median in
        logarithms.
        """
        lower, upper = quartiles_s
        if not (median_s > 0.0 and 0.0 < lower <= median_s <= upper):
            raise SimError(
                "quartiles must be positive and lie on either side of the median, got "
                f"{lower:g} and {upper:g} s about {median_s:g} s"
            )
        return cls(median_s, math.log(upper / lower) / (2.0 * UPPER_QUARTILE))

    @property
    def mean_s(self) -> float:
        """Expected duration."""
        return self.median_s * math.exp(0.5 * self.sigma**2)

    def draw_s(self, rng: np.random.Generator) -> float:
        """Draw a duration."""
        return self.median_s * math.exp(self.sigma * rng.standard_normal())
