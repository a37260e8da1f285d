"""An estimate with its confidence interval, and exact intervals of shares."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from scipy.special import betaincinv

from perception.arrays import finite_number

from ...world.errors import SimError

#: A narrow space that breaks no line, before a sign of per cent.
THIN: Final = "\N{NARROW NO-BREAK SPACE}"
#: What stands for a number that there is not.
NOTHING: Final = "–"
# Shares this near to 0 or 1 are 0 or 1.
_ROUNDING: Final = 1e-12
#: With fewer pairs, the bootstrap interval is too narrow, and no effect counts as shown.
FEW_PAIRS: Final = 20


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate with its confidence interval.

    Attributes:
        value: the estimate; NaN when there is none.
        low: lower end of the interval, −inf where the data do not bound it.
        high: upper end, +inf where the data do not bound it.
        n: number of episodes, or of pairs of episodes, behind the estimate.
        left_out: number of episodes or pairs to which the metric does not apply.
    """

    value: float
    low: float
    high: float
    n: int
    left_out: int = 0

    @property
    def known(self) -> bool:
        """True if there is an estimate."""
        return math.isfinite(self.value)

    @property
    def bounded(self) -> bool:
        """True if the interval is finite on both sides."""
        return math.isfinite(self.low) and math.isfinite(self.high)

    @property
    def count(self) -> int:
        """Number of episodes behind a share."""
        return round(self.value * self.n) if self.n else 0

    def share_text(self) -> str:
        """Return a share of episodes as ``"0 of 23 (≤ 12 %)"``: the count, and the interval."""
        if not self.n:
            return NOTHING
        ends = f"{100.0 * self.low:.1f}–{100.0 * self.high:.1f}{THIN}%"
        if self.value == 0.0:
            ends = f"≤ {percent(self.high)}"
        elif self.value == 1.0:
            ends = f"≥ {percent(self.low)}"
        return f"{self.count} of {self.n} ({ends})"

    def text(self, decimals: int = 2, scale: float = 1.0) -> str:
        """Return ``"1.23 [1.01, 1.50]"``, ``"1.23 [?]"`` without bounds, a dash without a value.

        Args:
            decimals: of the value and both ends.
            scale: multiplies the value and both ends; 100 for per cent.
        """
        if not self.known:
            return NOTHING
        value = number_text(self.value * scale, decimals)
        if not self.bounded:
            return f"{value} [?]"
        low, high = (number_text(bound * scale, decimals) for bound in (self.low, self.high))
        return f"{value} [{low}, {high}]"


def number_text(value: float | None, decimals: int = 2) -> str:
    """Return a number with the given decimals, without the sign of a negative zero.

    None, NaN and infinity are a dash.
    """
    if value is None or not math.isfinite(value):
        return NOTHING
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if float(text) == 0.0 else text


def percent(share: float) -> str:
    """Return a share in per cent, with more decimals near 0 and 1: 0.9975 is no 100 %."""
    if not math.isfinite(share):
        return NOTHING
    rest = min(abs(share), abs(1.0 - abs(share)))
    decimals = 0 if rest >= 0.1 or rest < _ROUNDING else 1 if rest >= 0.01 else 2
    return f"{100.0 * share:.{decimals}f}{THIN}%"


def zero_of_n_upper(n: int, level: float = 0.95) -> float:
    """Return the upper bound of a share after 0 of n independent trials: 1 − (1 − level)^(1/n).

    This is the one-sided bound of Clopper and Pearson (1934), about 3/n at 95 %; 1 for n = 0.

    Raises:
        SimError: n < 0, or level outside (0, 1).
    """
    level = _checked_level(n, n, level)
    return 1.0 if n == 0 else float(1.0 - (1.0 - level) ** (1.0 / n))


def proportion_interval(count: int, n: int, level: float = 0.95) -> Interval:
    """Return the share ``count / n`` with its exact interval (Clopper and Pearson 1934).

    The interval is two-sided. For a count of 0 or n, its one free end is the one-sided bound of
    :func:`zero_of_n_upper`.

    Raises:
        SimError: not 0 ≤ count ≤ n, or level outside (0, 1).
    """
    level = _checked_level(count, n, level)
    if n == 0:
        return Interval(float("nan"), 0.0, 1.0, 0)
    if count == 0:
        return Interval(0.0, 0.0, zero_of_n_upper(n, level), n)
    if count == n:
        return Interval(1.0, 1.0 - zero_of_n_upper(n, level), 1.0, n)
    tail = 0.5 * (1.0 - level)
    low = float(betaincinv(count, n - count + 1, tail))
    high = float(betaincinv(count + 1, n - count, 1.0 - tail))
    return Interval(count / n, low, high, n)


def _checked_level(count: int, n: int, level: float) -> float:
    """Return the level; refuse a count that is not between 0 and n."""
    if not 0 <= count <= n:
        raise SimError(f"a share must be of 0 to n episodes, got {count} of {n}")
    level = finite_number("level", level, SimError, minimum=0.0, exclusive_minimum=True)
    if level >= 1.0:
        raise SimError(f"level must lie in (0, 1), got {level:g}")
    return level
