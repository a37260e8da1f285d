"""Estimates from episodes of the report; the mathematics is that of :mod:`sim_tests.measures`.

Everything here takes its own generator of seed 0, so that a figure does not depend on which others
the page shows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ..measures._bootstrap import bootstrap_interval
from ..measures._episode_record import EpisodeRecord
from ..measures._interval import Interval
from ..measures._pairs import (
    paired_difference,
    violation_excess,
    violation_excess_of_time,
    won_back,
)
from ..measures._proportions import proportion_interval
from ._episode import Episode

Value = Callable[[EpisodeRecord], "float | None"]


def records_of(episodes: Iterable[Episode]) -> tuple[EpisodeRecord, ...]:
    """Their rows."""
    return tuple(each.record for each in episodes)


def of_attention(episodes: Iterable[Episode], attention: str) -> tuple[Episode, ...]:
    """The episodes of scenarios of that attention."""
    return tuple(each for each in episodes if each.record.attention == attention)


def mean_of(episodes: Iterable[Episode], value: Value) -> Interval:
    """The mean over the episodes that have a value, resampled within scenarios."""
    known = [
        ((each.record.scenario, each.record.scenario_version), number)
        for each in episodes
        if (number := value(each.record)) is not None
    ]
    return bootstrap_interval(
        [number for _, number in known],
        np.random.default_rng(0),
        strata=[scenario for scenario, _ in known],
    )


def plain_mean(episodes: Iterable[Episode], value: Value) -> float | None:
    """The mean alone; None without a value."""
    known = [number for each in episodes if (number := value(each.record)) is not None]
    return float(np.mean(known)) if known else None


def share_of(episodes: Sequence[Episode], value: Value) -> Interval:
    """The share of episodes whose value is above 0, with its exact interval."""
    hits = sum((value(each.record) or 0.0) > 0.0 for each in episodes)
    return proportion_interval(hits, len(episodes))


def difference_of(
    reference: Iterable[Episode], episodes: Iterable[Episode], field: str
) -> Interval:
    """The mean difference over pairs of the same scenario and seed: the others less the first."""
    return paired_difference(records_of(reference), records_of(episodes), field)


def won_back_of(reference: Iterable[Episode], episodes: Iterable[Episode]) -> Interval:
    """The share of the time that the reference loses which the others win back."""
    return won_back(records_of(reference), records_of(episodes))


def excess_of(reference: Iterable[Episode], episodes: Iterable[Episode]) -> tuple[Interval, str]:
    """How much longer the margin is violated, and in terms of what.

    Relative to the violation of the reference; to its time where it violates nothing.
    """
    first, second = records_of(reference), records_of(episodes)
    excess = violation_excess(first, second)
    if excess.known:
        return excess, "of its violation"
    return violation_excess_of_time(first, second), "of its time"
