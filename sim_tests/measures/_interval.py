"""A figure with its confidence interval."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Interval:
    """A figure and what the data leave open about it.

    Attributes:
        value: the estimate; NaN when there is none.
        low: lower end of the interval, −inf where the data do not bound it.
        high: upper end, +inf where the data do not bound it.
        n: episodes, or pairs of them, behind it.
        left_out: episodes or pairs that could not say anything.
    """

    value: float
    low: float
    high: float
    n: int
    left_out: int = 0

    @property
    def known(self) -> bool:
        """There is an estimate."""
        return math.isfinite(self.value)

    @property
    def bounded(self) -> bool:
        """The interval is finite on both sides."""
        return math.isfinite(self.low) and math.isfinite(self.high)

    def text(self, decimals: int = 2, scale: float = 1.0) -> str:
        """``"1.23 [1.01, 1.50]"``; ``"1.23 [?]"`` without bounds, a dash without a value.

        Args:
            decimals: of all three.
            scale: multiplies all three, 100 for per cent.
        """
        if not self.known:
            return "–"
        value = number_text(self.value * scale, decimals)
        if not self.bounded:
            return f"{value} [?]"
        low, high = (number_text(bound * scale, decimals) for bound in (self.low, self.high))
        return f"{value} [{low}, {high}]"


def number_text(value: float, decimals: int) -> str:
    """A number with so many decimals, without a negative zero."""
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if float(text) == 0.0 else text
