"""Section of a report: each fault with each arm, compared with the same seeds without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..measures import Metric, paired_difference
from ._arm import Arm, Episode
from ._statistics import TIME_LOST, VIOLATION, RunStatistics, moving_contacts
from ._text import NOTHING, count, number, percent


@dataclass(frozen=True, slots=True)
class FaultRow:
    """One fault with one arm, as texts; differences are to the same seeds without a fault."""

    fault: str
    arm: str
    look: int
    episodes: str
    contacts: str
    at_most: str
    touched: bool
    time_lost: str
    more_time: str
    violation: str
    more_violation: str
    least_margin: str


def fault_rows(statistics: RunStatistics) -> tuple[FaultRow, ...]:
    """Return one row per fault and arm, sorted by fault; empty without faults."""
    rows = []
    for arm in statistics.arms:
        for fault in sorted({each.record.fault for each in arm.others}):
            episodes = tuple(each for each in arm.others if each.record.fault == fault)
            contacts = moving_contacts(episodes)
            hits = sum(each.record.moving_touched for each in episodes)
            margins = [
                each.record.min_margin_m
                for each in episodes
                if each.record.min_margin_m is not None
            ]
            lost, violated = (_mean(episodes, each) for each in (TIME_LOST, VIOLATION))
            rows.append(
                FaultRow(
                    fault,
                    arm.name,
                    arm.look,
                    count(len(episodes)),
                    count(hits),
                    percent(contacts.high),
                    hits > 0,
                    number(lost, 1),
                    _difference_text(arm, episodes, TIME_LOST, 1),
                    number(violated, 2),
                    _difference_text(arm, episodes, VIOLATION, 2),
                    number(min(margins) if margins else None, 2),
                )
            )
    return tuple(sorted(rows, key=lambda row: row.fault))


def _difference_text(arm: Arm, episodes: Sequence[Episode], metric: Metric, decimals: int) -> str:
    before, now = ([each.record for each in part] for part in (arm.episodes, episodes))
    change = paired_difference(before, now, metric.name)
    if not change.known:
        return NOTHING
    if not change.bounded:
        return number(change.value, decimals, sign=True)
    ends = (
        f"{number(change.low, decimals, sign=True)} to {number(change.high, decimals, sign=True)}"
    )
    return f"{number(change.value, decimals, sign=True)} ({ends})"


def _mean(episodes: Sequence[Episode], metric: Metric) -> float | None:
    known = [value for each in episodes if (value := getattr(each.record, metric.name)) is not None]
    return sum(known) / len(known) if known else None
