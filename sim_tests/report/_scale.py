"""An axis: values to places in per cent of its length, and round numbers to mark it with."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ._text import number


@dataclass(frozen=True, slots=True)
class Scale:
    """A linear axis from ``low`` to ``high``, ``low < high``."""

    low: float
    high: float

    @classmethod
    def over(cls, values: Iterable[float], *, zero: bool = False, pad: float = 0.06) -> Scale:
        """The axis that holds all values with some room about them.

        Args:
            values: finite; without any the axis runs from 0 to 1.
            zero: also holds 0, without room beyond it.
            pad: room at each end, as a share of the length.
        """
        known = [*values, *([0.0] if zero else [])]
        low, high = (min(known), max(known)) if known else (0.0, 1.0)
        if high - low < 1e-9:
            low, high = (low, low + 1.0) if zero and low == 0.0 else (low - 0.5, high + 0.5)
        room = pad * (high - low)
        return cls(
            low if zero and low == 0.0 else low - room,
            high if zero and high == 0.0 else high + room,
        )

    def place(self, value: float) -> float:
        """Where a value lies, in per cent; values beyond an end lie at it."""
        share = (value - self.low) / (self.high - self.low)
        return round(100.0 * min(max(share, 0.0), 1.0), 2)

    def ticks(self, most: int = 5) -> tuple[tuple[float, str], ...]:
        """At most so many round values in the axis: places in per cent and texts."""
        step = _round_step((self.high - self.low) / max(most - 1, 1))
        decimals = max(0, -math.floor(math.log10(step) + 1e-9))
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return tuple(
            (self.place(index * step), number(index * step, decimals))
            for index in range(first, last + 1)
        )


def _round_step(least: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is not below ``least``."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(
        factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * 0.999
    )
