"""Shares of episodes: exact intervals, and what none of n says."""

from __future__ import annotations

from scipy.stats import beta

from perception.arrays import finite_number

from .._errors import SimError
from ._interval import Interval


def zero_of_n_upper(n: int, level: float = 0.95) -> float:
    """Upper bound of a share of which n independent trials showed none: 1 − (1 − level)^(1/n).

    The one-sided bound of Clopper and Pearson (1934), about 3/n at 95 %; 1 without trials.

    Raises:
        SimError: n < 0, or level outside (0, 1).
    """
    n, level = _checked(n, n, level)
    return 1.0 if n == 0 else float(1.0 - (1.0 - level) ** (1.0 / n))


def proportion_interval(count: int, n: int, level: float = 0.95) -> Interval:
    """The share ``count`` of ``n`` with its exact interval (Clopper and Pearson 1934).

    Two-sided; for none and for all of n the one free end is the one-sided bound, as in
    :func:`zero_of_n_upper`.

    Raises:
        SimError: not 0 ≤ count ≤ n, or level outside (0, 1).
    """
    n, level = _checked(count, n, level)
    if n == 0:
        return Interval(float("nan"), 0.0, 1.0, 0)
    if count == 0:
        return Interval(0.0, 0.0, zero_of_n_upper(n, level), n)
    if count == n:
        return Interval(1.0, 1.0 - zero_of_n_upper(n, level), 1.0, n)
    tail = 0.5 * (1.0 - level)
    low = float(beta.ppf(tail, count, n - count + 1))
    high = float(beta.ppf(1.0 - tail, count + 1, n - count))
    return Interval(count / n, low, high, n)


def _checked(count: int, n: int, level: float) -> tuple[int, float]:
    if not 0 <= count <= n:
        raise SimError(f"a share must be of 0 to n episodes, got {count} of {n}")
    level = finite_number("level", level, SimError, minimum=0.0, exclusive_minimum=True)
    if level >= 1.0:
        raise SimError(f"level must lie in (0, 1), got {level:g}")
    return n, level
