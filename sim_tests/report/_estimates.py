"""Estimates with confidence intervals from episodes; the mathematics is in :mod:`..measures`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.stats import beta

from ..measures._episode_record import EpisodeRecord
from ._episode import Episode

LEVEL: Final = 0.95
_SEED: Final = 0
_RESAMPLES: Final = 2000

Value = Callable[[EpisodeRecord], "float | None"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """An estimate with its 95 % confidence interval.

    Attributes:
        value: the estimate.
        low: end of the interval.
        high: end of the interval.
        count: of episodes, or of pairs of episodes, that it rests on.
    """

    value: float
    low: float
    high: float
    count: int


def mean_of(episodes: Iterable[Episode], value: Value) -> Estimate | None:
    """The mean over the episodes that have a value; None without any."""
    values = [number for each in episodes if (number := value(each.record)) is not None]
    if not values:
        return None
    rng = np.random.default_rng(_SEED)
    data = np.asarray(values)
    means = data[rng.integers(len(data), size=(_RESAMPLES, len(data)))].mean(axis=1)
    low, high = np.quantile(means, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Estimate(float(data.mean()), float(low), float(high), len(values))


def share_of(hits: int, count: int) -> Estimate | None:
    """A share with the exact interval of Clopper and Pearson, one-sided for none of ``count``."""
    if not count:
        return None
    if not hits:
        return Estimate(0.0, 0.0, float(1.0 - (1.0 - LEVEL) ** (1.0 / count)), count)
    tail = (1.0 - LEVEL) / 2.0
    low = float(beta.ppf(tail, hits, count - hits + 1))
    high = float(beta.ppf(1.0 - tail, hits + 1, count - hits)) if hits < count else 1.0
    return Estimate(hits / count, low, high, count)


def pairs_of(
    reference: Iterable[Episode], episodes: Iterable[Episode]
) -> list[tuple[EpisodeRecord, EpisodeRecord]]:
    """Records of the same scenario, version and seed: the reference's and the other's."""
    known = {each.pair: each.record for each in reference}
    return [(known[each.pair], each.record) for each in episodes if each.pair in known]


def difference_of(
    reference: Iterable[Episode], episodes: Iterable[Episode], value: Value
) -> Estimate | None:
    """The mean paired difference, the others less the reference; None without a pair."""
    differences = [
        second - first
        for one, other in pairs_of(reference, episodes)
        if (first := value(one)) is not None and (second := value(other)) is not None
    ]
    if not differences:
        return None
    rng = np.random.default_rng(_SEED)
    data = np.asarray(differences)
    means = data[rng.integers(len(data), size=(_RESAMPLES, len(data)))].mean(axis=1)
    low, high = np.quantile(means, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Estimate(float(data.mean()), float(low), float(high), len(data))


def won_back_of(reference: Sequence[Episode], episodes: Sequence[Episode]) -> Estimate | None:
    """The share of the time that the reference loses which the others win back."""
    pairs = [
        (one.time_lost_s, other.time_lost_s)
        for one, other in pairs_of(reference, episodes)
        if one.time_lost_s is not None and other.time_lost_s is not None
    ]
    if not pairs:
        return None
    data = np.asarray(pairs)
    if data[:, 0].sum() <= 0.0:
        return None
    rng = np.random.default_rng(_SEED)
    sums = data[rng.integers(len(data), size=(_RESAMPLES, len(data)))].sum(axis=1)
    ratio = 1.0 - sums[:, 1] / sums[:, 0]
    low, high = np.quantile(ratio, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    total = data.sum(axis=0)
    return Estimate(float(1.0 - total[1] / total[0]), float(low), float(high), len(data))
