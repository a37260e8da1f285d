"""Confidence intervals of metrics: shares, rates, percentiles and means, and any bootstrap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from scipy.special import bdtr, betaincinv, gammaincinv, ndtr, ndtri

from perception.arrays import FloatArray

#: Confidence of intervals, two-sided.
LEVEL: Final = 0.95
#: Fewer values than this bound no mean: their bootstrap is too narrow.
MIN_RESAMPLED: Final = 10
#: Resamples of a bootstrap.
RESAMPLES: Final = 2000
# More values than this have a mean that is normal enough, and their bootstrap would take seconds.
_NORMAL_FROM: Final = 1000
_TAIL: Final = 0.5 * (1.0 - LEVEL)

#: Lower and upper end; infinite where the values do not bound the metric.
Ends = tuple[float, float]
UNBOUNDED: Final[Ends] = (-math.inf, math.inf)


class Metrics:
    """Metrics of one group by name, with the intervals of those that are estimates.

    A metric to which nobody contributes is None and has no interval.

    Attributes:
        values: the metrics, in the order in which they were added.
        intervals: :data:`Ends` by the name of the metric.
    """

    def __init__(self) -> None:
        self.values: dict[str, Any] = {}
        self.intervals: dict[str, Ends] = {}

    def count(self, name: str, number: int) -> None:
        """Add a number of people."""
        self.values[name] = number

    def share(self, name: str, part: int, whole: int) -> None:
        """Add the share ``part / whole``."""
        self.add(name, part / whole if whole else None, share_interval(part, whole))

    def shares(self, name: str, flags: Sequence[bool]) -> None:
        """Add the share of flags that are true."""
        value = float(np.mean(flags)) if flags else None
        self.add(name, value, share_interval(sum(flags), len(flags)))

    def mean(self, name: str, values: Sequence[float]) -> None:
        """Add a mean."""
        self.add(name, float(np.mean(values)) if values else None, mean_interval(values))

    def rate(self, name: str, total: int, frames: int) -> None:
        """Add the number of events per frame."""
        self.add(name, total / frames if frames else None, rate_interval(total, frames))

    def percentile(self, name: str, values: Sequence[float], percent: float) -> None:
        """Add a percentile, 50 for the median."""
        value = float(np.percentile(values, percent)) if values else None
        self.add(name, value, percentile_interval(values, percent))

    def add(self, name: str, value: float | None, ends: Ends) -> None:
        """Add a metric with its interval."""
        self.values[name] = value
        if value is not None:
            self.intervals[name] = ends


def share_interval(part: int, whole: int, tail: float = _TAIL) -> Ends:
    """Return the exact interval of a share (Clopper and Pearson 1934); 0 to 1 for none of none.

    The score interval (Wilson 1927) is narrower, but its lower end is too high for a few of many:
    it excludes a share of 0.5 % after 1 of 26, which happens in 12 % of such samples. Each end
    leaves out ``tail``.
    """
    low = float(betaincinv(part, whole - part + 1, tail)) if part else 0.0
    high = float(betaincinv(part + 1, whole - part, 1.0 - tail)) if part < whole else 1.0
    return low, high


def rate_interval(total: int, frames: int) -> Ends:
    """Return the exact interval of the rate of a Poisson process (Garwood 1936)."""
    if not frames:
        return 0.0, math.inf
    low = float(gammaincinv(total, _TAIL)) if total else 0.0
    return low / frames, float(gammaincinv(total + 1, 1.0 - _TAIL)) / frames


def percentile_interval(values: Sequence[float], percent: float) -> Ends:
    """Return the interval of a percentile between two of the sorted values.

    The number of values below the true percentile is binomial, whatever their distribution
    (Conover 1999, section 3.2). Too few values leave an end infinite: fewer than 6 for a median,
    fewer than 36 for the upper end of a 90th percentile.
    """
    ranked = np.sort(np.asarray(values, dtype=np.float64))
    n = len(ranked)
    below = bdtr(np.arange(n), n, 0.01 * percent)  # P(at most k of n lie below), k = 0 … n − 1
    low = int(np.count_nonzero(below <= _TAIL))
    high = int(np.count_nonzero(below < 1.0 - _TAIL)) + 1
    return (
        float(ranked[low - 1]) if low else -math.inf,
        float(ranked[high - 1]) if high <= n else math.inf,
    )


def mean_interval(values: Sequence[float]) -> Ends:
    """Return the interval of a mean.

    It is the bias-corrected and accelerated bootstrap (Efron 1987), or the normal interval above
    1000 values. Values that are fewer than ten, or not finite, bound nothing.
    """
    sample = np.asarray(values, dtype=np.float64)
    n = len(sample)
    if n < MIN_RESAMPLED or not np.isfinite(sample).all():
        return UNBOUNDED
    mean, spread = float(sample.mean()), float(sample.std(ddof=1))
    if n > _NORMAL_FROM:
        half = float(ndtri(1.0 - _TAIL)) * spread / math.sqrt(n)
        return mean - half, mean + half
    rows = np.random.default_rng(0).integers(0, n, (RESAMPLES, n))
    residuals = sample - mean
    scale = float((residuals**2).sum()) ** 1.5
    skewness = float((residuals**3).sum()) / (6.0 * scale) if scale > 0.0 else 0.0
    return bootstrap_ends(mean, sample[rows].mean(axis=1), skewness)


def bootstrap_ends(
    value: float, resampled: FloatArray, acceleration: float = 0.0, tail: float = _TAIL
) -> Ends:
    """Return the bias-corrected (and accelerated) ends of an estimate's bootstrap.

    Args:
        value: the estimate.
        resampled: (B,) estimates of resamples.
        acceleration: a sixth of the skewness of the influence of single values.
        tail: left out by each end.
    """
    close = 1.0e-12 * max(abs(value), float(np.abs(resampled).max()))
    # Ties count half: with few distinct values, many resamples may equal the estimate.
    below = float(np.mean(resampled < value - close))
    below += 0.5 * float(np.mean(np.abs(resampled - value) <= close))
    # With all resamples on one side, the bias would be infinite.
    least = 0.5 / len(resampled)
    bias = float(ndtri(min(max(below, least), 1.0 - least)))
    moved = bias + ndtri(np.array([tail, 1.0 - tail]))
    low, high = np.quantile(resampled, ndtr(bias + moved / (1.0 - acceleration * moved))).tolist()
    return float(low), float(high)
