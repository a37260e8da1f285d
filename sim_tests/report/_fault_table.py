"""What each fault does to each policy, against the same seeds without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ._arm import Arm
from ._episode import Episode
from ._estimates import difference_of, mean_of
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
            if contacts is None:
                continue
            hits = round(contacts.value * contacts.count)
            margins = [
                each.record.min_margin_m for each in episodes if each.record.min_margin_m is not None
            ]
            lost, violated = (mean_of(episodes, each.value) for each in (TIME_LOST, VIOLATION))
            rows.append(
                FaultRow(
                    fault,
                    arm.name,
                    arm.look,
                    count(len(episodes)),
                    count(hits),
                    percent(contacts.high),
                    hits > 0,
                    number(None if lost is None else lost.value, 1),
                    _more(arm, episodes, TIME_LOST, 1),
                    number(None if violated is None else violated.value, 2),
                    _more(arm, episodes, VIOLATION, 2),
                    number(min(margins) if margins else None, 2),
                )
            )
    return tuple(sorted(rows, key=lambda row: row.fault))


def _more(arm: Arm, episodes: Sequence[Episode], measure: Measure, decimals: int) -> str:
    change = difference_of(arm.episodes, episodes, measure.value)
    if change is None:
        return NOTHING
    ends = f"{number(change.low, decimals, sign=True)} to {number(change.high, decimals, sign=True)}"
    return f"{number(change.value, decimals, sign=True)} ({ends})"
