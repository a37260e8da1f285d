"""What each fault does to each policy, against the same seeds without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ._arm import Arm
from ._episode import Episode
from ._estimates import difference_of, plain_mean
from ._measure import TIME_LOST, VIOLATION, Measure
from ._text import NOTHING, count, number, percent
from ._verdict import robot_contacts


@dataclass(frozen=True, slots=True)
class FaultRow:
    """One fault with one arm, as texts; differences are against the same seeds without a fault."""

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


def faults_of(arms: Sequence[Arm]) -> tuple[FaultRow, ...]:
    """A row a fault and arm, in the order of faults' names; empty without faults."""
    rows = []
    for arm in arms:
        for fault in sorted({each.record.fault for each in arm.faulted}):
            episodes = tuple(each for each in arm.faulted if each.record.fault == fault)
            contacts = robot_contacts(episodes)
            hits = sum(each.record.robot_contacts > 0 for each in episodes)
            margins = [
                each.record.min_margin_m
                for each in episodes
                if each.record.min_margin_m is not None
            ]
            lost, violated = (plain_mean(episodes, each.value) for each in (TIME_LOST, VIOLATION))
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
                    _more(arm, episodes, TIME_LOST, 1),
                    number(violated, 2),
                    _more(arm, episodes, VIOLATION, 2),
                    number(min(margins) if margins else None, 2),
                )
            )
    return tuple(sorted(rows, key=lambda row: row.fault))


def _more(arm: Arm, episodes: Sequence[Episode], measure: Measure, decimals: int) -> str:
    change = difference_of(arm.episodes, episodes, measure.key)
    if not change.known:
        return NOTHING
    if not change.bounded:
        return number(change.value, decimals, sign=True)
    ends = (
        f"{number(change.low, decimals, sign=True)} to {number(change.high, decimals, sign=True)}"
    )
    return f"{number(change.value, decimals, sign=True)} ({ends})"
