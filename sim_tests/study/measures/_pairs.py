"""Comparison of two policies over pairs of episodes of the same scenario and seed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from ...world.errors import SimError
from ._bootstrap import bootstrap_interval, ratio_interval
from ._interval import Interval, proportion_interval
from ._metrics import COLUMNS
from ._record import EpisodeRecord

Pair = tuple[EpisodeRecord, EpisodeRecord]

# Violation times that differ by less count as equal.
_SAME_TIME_S: Final = 1e-6


def paired(base: Iterable[EpisodeRecord], other: Iterable[EpisodeRecord]) -> tuple[Pair, ...]:
    """Return the pairs of episodes of the same scenario, version and seed, ordered by these.

    Both episodes start with the same people; what they do later may depend on the robot.

    Raises:
        SimError: one side has an episode twice.
    """
    first, second = _by_key(base), _by_key(other)
    return tuple((first[key], second[key]) for key in sorted(first.keys() & second.keys()))


def paired_difference(
    base: Iterable[EpisodeRecord],
    other: Iterable[EpisodeRecord],
    field: str,
    rng: np.random.Generator | None = None,
    level: float = 0.95,
) -> Interval:
    """Return the mean of ``other`` − ``base`` over pairs, with its bootstrap interval.

    Resamples are drawn within scenarios. Pairs in which the field is None on either side are left
    out and counted.

    Args:
        base: episodes of one policy.
        other: episodes of the other policy.
        field: a number, count or flag of :class:`EpisodeRecord`.
        rng: draws the resamples; None for a generator with seed 0.
        level: confidence of the interval.

    Raises:
        SimError: one side has an episode twice, or the field holds no number.
    """
    if field not in COLUMNS or COLUMNS[field].kind == "text":
        raise SimError(f"field must be a number of an episode, got {field!r}")
    pairs = paired(base, other)
    kept = _with_numbers(pairs, field)
    differences = [getattr(second, field) - getattr(first, field) for first, second in kept]
    interval = bootstrap_interval(differences, _rng(rng), level, strata=_scenarios(kept))
    return replace(interval, left_out=len(pairs) - len(kept))


def paired_ratio(
    base: Iterable[EpisodeRecord],
    other: Iterable[EpisodeRecord],
    field: str,
    over: str,
    rng: np.random.Generator | None = None,
    level: float = 0.95,
    *,
    sign: float = 1.0,
) -> Interval:
    """Return Σ (``other`` − ``base``) of a field over Σ of a field of ``base``, over pairs.

    It is not a mean of shares, in which an episode that lost almost no time would weigh as much as
    any other. Resamples are drawn within scenarios. Pairs in which a field is None on either side
    are left out and counted.

    Args:
        base: episodes of one policy.
        other: episodes of the other policy.
        field: a number of :class:`EpisodeRecord`, whose differences are summed.
        over: the field of ``base`` whose sum they are divided by.
        rng: draws the resamples; None for a generator with seed 0.
        level: confidence of the interval.
        sign: −1 for the differences ``base`` − ``other``.

    Returns:
        The ratio; NaN if ``over`` is 0 in every episode of ``base``.

    Raises:
        SimError: one side has an episode twice.
    """
    pairs = paired(base, other)
    kept = _with_numbers(_with_numbers(pairs, field), over)
    interval = ratio_interval(
        [sign * (getattr(second, field) - getattr(first, field)) for first, second in kept],
        [getattr(first, over) for first, _ in kept],
        _rng(rng),
        level,
        strata=_scenarios(kept),
    )
    return replace(interval, left_out=len(pairs) - len(kept))


def violates_more(
    base: Iterable[EpisodeRecord], other: Iterable[EpisodeRecord], level: float = 0.95
) -> Interval:
    """Return the share of pairs in which ``other`` violates the margin longer than ``base``.

    Its interval is exact.
    """
    pairs = _with_numbers(paired(base, other), "violation_time_s")
    more = sum(
        (second.violation_time_s or 0.0) > (first.violation_time_s or 0.0) + _SAME_TIME_S
        for first, second in pairs
    )
    return proportion_interval(more, len(pairs), level)


def _with_numbers(pairs: Sequence[Pair], field: str) -> tuple[Pair, ...]:
    return tuple(
        pair
        for pair in pairs
        if all(not record.error and getattr(record, field) is not None for record in pair)
    )


def _scenarios(pairs: Sequence[Pair]) -> list[tuple[str, int]]:
    return [(first.scenario, first.scenario_version) for first, _ in pairs]


def _by_key(records: Iterable[EpisodeRecord]) -> dict[tuple[str, int, int], EpisodeRecord]:
    found: dict[tuple[str, int, int], EpisodeRecord] = {}
    for record in records:
        key = (record.scenario, record.scenario_version, record.seed)
        if key in found:
            raise SimError(
                f"scenario {record.scenario!r}, seed {record.seed} is there twice for policy "
                f"{record.policy!r}: pairs need one episode each"
            )
        found[key] = record
    return found


def _rng(rng: np.random.Generator | None) -> np.random.Generator:
    return np.random.default_rng(0) if rng is None else rng
