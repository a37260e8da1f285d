"""Bootstrap confidence intervals of means and of ratios of sums, within strata."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from perception.arrays import FloatArray, finite_array, finite_number

from ...world.errors import SimError
from ._interval import Interval

RESAMPLES: Final = 4000
# Drawn at once, to bound the memory.
_CELLS_AT_ONCE: Final = 2_000_000


def bootstrap_interval(
    values: Any,
    rng: np.random.Generator,
    level: float = 0.95,
    *,
    strata: Sequence[Hashable] | None = None,
    resamples: int = RESAMPLES,
) -> Interval:
    """The mean of some values with its BCa bootstrap interval; see :func:`ratio_intervals`.

    Args:
        values: (N,) finite.
        rng: draws the resamples.
        level: of confidence, in (0, 1).
        strata: N labels; values are drawn again from those of their own label.
        resamples: how many.

    Raises:
        SimError: values that are not finite, or labels that are not as many.
    """
    checked = finite_array("values", values, ("N",), SimError)[:, None]
    return replace(
        ratio_intervals(
            checked, np.ones_like(checked), rng, level, strata=strata, resamples=resamples
        )[0],
        n=len(checked),
    )


def ratio_interval(
    numerators: Any,
    denominators: Any,
    rng: np.random.Generator,
    level: float = 0.95,
    *,
    strata: Sequence[Hashable] | None = None,
    resamples: int = RESAMPLES,
) -> Interval:
    """The ratio of two sums over episodes with its bootstrap interval; see :func:`ratio_intervals`.

    Args:
        numerators: (N,) finite.
        denominators: (N,) finite; all 1 for a mean.
        rng: draws the resamples.
        level: of confidence, in (0, 1).
        strata: N labels, or None.
        resamples: how many.
    """
    top = finite_array("numerators", numerators, ("N",), SimError)
    bottom = finite_array("denominators", denominators, (len(top),), SimError)
    columns = (top[:, None], bottom[:, None])
    interval = ratio_intervals(*columns, rng, level, strata=strata, resamples=resamples)[0]
    return replace(interval, n=len(top))


def ratio_intervals(
    numerators: Any,
    denominators: Any,
    rng: np.random.Generator,
    level: float = 0.95,
    *,
    strata: Sequence[Hashable] | None = None,
    resamples: int = RESAMPLES,
) -> tuple[Interval, ...]:
    """Ratios of sums over the same episodes, each with its bootstrap interval.

    Bias-corrected and accelerated (Efron 1987), the acceleration from the empirical influence
    (Davison and Hinkley 1997, section 5.4). Within a stratum of n, n − 1 are drawn with replacement
    and weighted n/(n − 1) (Rao and Wu 1988): the plain bootstrap's variance is too small by
    (n − 1)/n, which matters for a few seeds a scenario. Strata of one are put together.

    Args:
        numerators: (N, M) finite.
        denominators: (N, M) finite; 1 for a mean, and 0 over 0 for an episode to which the figure
            does not apply.
        rng: draws the resamples.
        level: of confidence, in (0, 1).
        strata: N labels; episodes are drawn again from those of their own label. None for one.
        resamples: how many.

    Returns:
        M intervals. NaN without episodes or with a sum of denominators that is not positive;
        unbounded for a single episode, or when resamples with such a sum are more than the
        interval may leave out.

    Raises:
        SimError: numbers that are not finite, or labels that are not as many.
    """
    top = finite_array("numerators", numerators, ("N", "M"), SimError)
    bottom = finite_array("denominators", denominators, top.shape, SimError)
    level = finite_number("level", level, SimError, minimum=0.0, exclusive_minimum=True)
    if level >= 1.0:
        raise SimError(f"level must lie in (0, 1), got {level:g}")
    if strata is not None and len(strata) != len(top):
        raise SimError(f"strata must be {len(top)} labels, one a value, got {len(strata)}")
    groups = _groups(strata, len(top)) if len(top) > 1 else []
    tops, bottoms = np.zeros((2, resamples, top.shape[1]))
    for group in groups:
        for rows, weights in _draws(len(group), resamples, rng):
            tops[rows] += weights @ top[group]
            bottoms[rows] += weights @ bottom[group]
    applies = ((top != 0.0) | (bottom != 0.0)).sum(axis=0).tolist()
    return tuple(
        _interval(top[:, m], bottom[:, m], tops[:, m], bottoms[:, m], applies[m], groups, level)
        for m in range(top.shape[1])
    )


def _interval(
    top: FloatArray,
    bottom: FloatArray,
    tops: FloatArray,
    bottoms: FloatArray,
    n: int,
    groups: list[NDArray[np.intp]],
    level: float,
) -> Interval:
    """One ratio: (N,) terms, (B,) resampled sums, and how many terms there really are."""
    total = float(bottom.sum())
    if total <= 0.0:
        return Interval(np.nan, -np.inf, np.inf, n)
    value = float(top.sum()) / total
    usable = bottoms > 1e-12 * total
    if n < 2 or np.mean(~usable) > 0.5 * (1.0 - level):
        return Interval(value, -np.inf, np.inf, n)
    acceleration = _acceleration(top - value * bottom, groups)
    low, high = _bca(value, tops[usable] / bottoms[usable], acceleration, level)
    return Interval(value, low, high, n)


def _groups(strata: Sequence[Hashable] | None, n: int) -> list[NDArray[np.intp]]:
    """Rows of each stratum, at least two in each; singles together, or with the smallest."""
    if strata is None:
        return [np.arange(n)]
    rows: dict[Hashable, list[int]] = {}
    for row, label in enumerate(strata):
        rows.setdefault(label, []).append(row)
    groups = [group for group in rows.values() if len(group) > 1]
    singles = [row for group in rows.values() if len(group) == 1 for row in group]
    if len(singles) == 1 and groups:
        min(groups, key=len).extend(singles)
    elif singles:
        groups.append(singles)
    return [np.array(group) for group in groups]


def _draws(
    size: int, resamples: int, rng: np.random.Generator
) -> Iterator[tuple[slice, FloatArray]]:
    """Some resamples at a time: which, and (some, size) the weight of each episode in them."""
    some = max(_CELLS_AT_ONCE // size, 1)
    for start in range(0, resamples, some):
        count = min(some, resamples - start)
        drawn = rng.integers(0, size, (count, size - 1)) + size * np.arange(count)[:, None]
        times = np.bincount(drawn.ravel(), minlength=count * size).reshape(count, size)
        weights: FloatArray = times * np.float64(size / (size - 1))
        yield slice(start, start + count), weights


def _acceleration(residuals: FloatArray, groups: list[NDArray[np.intp]]) -> float:
    """Skewness of the empirical influence over six; the scale of the influence cancels."""
    largest = float(np.abs(residuals).max())
    if largest < np.finfo(np.float64).tiny:
        return 0.0
    second = third = 0.0
    for group in groups:
        influence = (residuals[group] - residuals[group].mean()) / largest
        second += float((influence**2).sum())
        third += float((influence**3).sum())
    return third / (6.0 * second**1.5) if second > 0.0 else 0.0


def _bca(
    value: float, resampled: FloatArray, acceleration: float, level: float
) -> tuple[float, float]:
    # Ties count half: with few distinct values much of the mass may lie on the estimate itself.
    tolerance = 1e-12 * max(abs(value), float(np.abs(resampled).max()))
    below = float(np.mean(resampled < value - tolerance))
    below += 0.5 * float(np.mean(np.abs(resampled - value) <= tolerance))
    # A whole resample on one side would send the bias to infinity.
    least = 0.5 / len(resampled)
    bias = float(ndtri(min(max(below, least), 1.0 - least)))
    ends = ndtri(np.array([0.5 * (1.0 - level), 0.5 * (1.0 + level)]))
    moved = bias + ends
    shares = ndtr(bias + moved / (1.0 - acceleration * moved))
    low, high = np.quantile(resampled, shares).tolist()
    return float(low), float(high)
