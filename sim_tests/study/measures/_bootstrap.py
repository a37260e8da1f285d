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
# Resamples are drawn in batches of so many numbers, to bound the memory.
_NUMBERS_PER_BATCH: Final = 2_000_000


def bootstrap_interval(
    values: Any,
    rng: np.random.Generator,
    level: float = 0.95,
    *,
    strata: Sequence[Hashable] | None = None,
    resamples: int = RESAMPLES,
) -> Interval:
    """Return the mean of (N,) finite values with its bootstrap interval.

    :func:`ratio_intervals` describes the method and the other arguments.

    Raises:
        SimError: values that are not finite, or another number of labels than of values.
    """
    checked = finite_array("values", values, ("N",), SimError)
    return ratio_interval(
        checked, np.ones_like(checked), rng, level, strata=strata, resamples=resamples
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
    """Return the ratio of two sums over (N,) episodes with its bootstrap interval.

    :func:`ratio_intervals` describes the method and the other arguments.
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
    """Return M ratios of sums over the same N episodes, each with its bootstrap interval.

    The interval is bias-corrected and accelerated (BCa; Efron 1987). The acceleration comes from
    the empirical influence (Davison and Hinkley 1997, section 5.4). Resamples are drawn within
    strata: of n episodes, n − 1 are drawn with replacement and weighted n/(n − 1) (Rao and Wu
    1988). The variance of the plain bootstrap is too small by (n − 1)/n, which matters with few
    seeds per scenario. Strata of one episode are joined.

    Args:
        numerators: (N, M) finite.
        denominators: (N, M) finite; 1 for a mean, and 0 over 0 for an episode to which the metric
            does not apply.
        rng: draws the resamples.
        level: confidence of the interval, in (0, 1).
        strata: a label for each of the N episodes, or None for a single stratum.
        resamples: number of resamples.

    Returns:
        M intervals. The value is NaN without episodes, or where the sum of denominators is not
        positive. The interval is unbounded for a single episode, or where more resamples have such
        a sum than the interval may leave out.

    Raises:
        SimError: numbers that are not finite, or another number of labels than of episodes.
    """
    top = finite_array("numerators", numerators, ("N", "M"), SimError)
    bottom = finite_array("denominators", denominators, top.shape, SimError)
    level = finite_number("level", level, SimError, minimum=0.0, exclusive_minimum=True)
    if level >= 1.0:
        raise SimError(f"level must lie in (0, 1), got {level:g}")
    tops, bottoms = _resampled_sums((top, bottom), rng, strata, resamples)
    groups = _groups(strata, len(top))
    applies = ((top != 0.0) | (bottom != 0.0)).sum(axis=0).tolist()
    return tuple(
        _interval(top[:, m], bottom[:, m], tops[:, m], bottoms[:, m], applies[m], groups, level)
        for m in range(top.shape[1])
    )


def resampled_means(
    values: Any,
    rng: np.random.Generator,
    *,
    strata: Sequence[Hashable] | None = None,
    resamples: int = RESAMPLES,
) -> FloatArray:
    """Return the (B, M) means of (N, M) finite values in B resamples of the N episodes.

    Resamples are drawn as for :func:`ratio_intervals`. All columns share them, so figures that are
    computed from several columns are paired. With a single episode all means are 0.

    Raises:
        SimError: values that are not finite, or another number of labels than of episodes.
    """
    checked = finite_array("values", values, ("N", "M"), SimError)
    (sums,) = _resampled_sums((checked,), rng, strata, resamples)
    means: FloatArray = sums / max(len(checked), 1)
    return means


def resampled_interval(
    value: float, resampled: FloatArray, n: int, level: float = 0.95
) -> Interval:
    """Return a figure of n episodes with the bias-corrected interval of its (B,) resamples.

    The interval is unbounded for a single episode, or where more resamples have no figure (NaN)
    than the interval may leave out.
    """
    usable = np.isfinite(resampled)
    if not np.isfinite(value) or n < 2 or np.mean(~usable) > 0.5 * (1.0 - level):
        return Interval(value, -np.inf, np.inf, n)
    return Interval(value, *_bca(value, resampled[usable], 0.0, level), n)


def _resampled_sums(
    columns: Sequence[FloatArray],
    rng: np.random.Generator,
    strata: Sequence[Hashable] | None,
    resamples: int,
) -> list[FloatArray]:
    """Return the (B, M) sums of each of the (N, M) columns in the same resamples."""
    n = len(columns[0])
    if strata is not None and len(strata) != n:
        raise SimError(f"strata must be {n} labels, one per value, got {len(strata)}")
    sums = [np.zeros((resamples, each.shape[1])) for each in columns]
    for group in _groups(strata, n):
        for rows, weights in _draws(len(group), resamples, rng):
            for total, each in zip(sums, columns, strict=True):
                total[rows] += weights @ each[group]
    return sums


def _groups(strata: Sequence[Hashable] | None, n: int) -> list[NDArray[np.intp]]:
    """Return the rows of each stratum; none for a single episode."""
    return _strata_rows(strata, n) if n > 1 else []


def _interval(
    top: FloatArray,
    bottom: FloatArray,
    tops: FloatArray,
    bottoms: FloatArray,
    n: int,
    groups: list[NDArray[np.intp]],
    level: float,
) -> Interval:
    """Return the interval of one ratio.

    Args:
        top: (N,) numerators.
        bottom: (N,) denominators.
        tops: (B,) resampled sums of the numerators.
        bottoms: (B,) resampled sums of the denominators.
        n: number of episodes to which the metric applies.
        groups: rows of each stratum.
        level: confidence.
    """
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


def _strata_rows(strata: Sequence[Hashable] | None, n: int) -> list[NDArray[np.intp]]:
    """Return the rows of each stratum, at least two per stratum.

    Strata of one row are joined; a single one joins the smallest stratum.
    """
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
    """Yield batches of resamples: their rows, and the (batch, size) weight of each episode."""
    batch = max(_NUMBERS_PER_BATCH // size, 1)
    for start in range(0, resamples, batch):
        count = min(batch, resamples - start)
        drawn = rng.integers(0, size, (count, size - 1)) + size * np.arange(count)[:, None]
        times = np.bincount(drawn.ravel(), minlength=count * size).reshape(count, size)
        weights: FloatArray = times * np.float64(size / (size - 1))
        yield slice(start, start + count), weights


def _acceleration(residuals: FloatArray, groups: list[NDArray[np.intp]]) -> float:
    """Return a sixth of the skewness of the empirical influence; its scale cancels."""
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
    """Return both ends of the BCa interval of an estimate, from its resampled values."""
    # Ties count half: with few distinct values, many resamples may equal the estimate.
    tolerance = 1e-12 * max(abs(value), float(np.abs(resampled).max()))
    below = float(np.mean(resampled < value - tolerance))
    below += 0.5 * float(np.mean(np.abs(resampled - value) <= tolerance))
    # With all resamples on one side, the bias would be infinite.
    least = 0.5 / len(resampled)
    bias = float(ndtri(min(max(below, least), 1.0 - least)))
    ends = ndtri(np.array([0.5 * (1.0 - level), 0.5 * (1.0 + level)]))
    moved = bias + ends
    shares = ndtr(bias + moved / (1.0 - acceleration * moved))
    low, high = np.quantile(resampled, shares).tolist()
    return float(low), float(high)
