"""The figures of a page: the summary that ``awarenav compare`` prints, by arm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..measures import (
    Comparison,
    EpisodeRecord,
    Interval,
    Summary,
    SummaryRow,
    Variant,
    labels,
    proportion_interval,
    summarise,
)
from ._arm import Arm, Episode, arms_of
from ._measure import Measure


@dataclass(frozen=True, slots=True)
class Figures:
    """What is known about the arms of a run.

    Attributes:
        fault: that all but the table of faults is about; empty for none, which comes first.
        arms: in the order in which they are shown.
        summary: of the episodes under that fault.
        names: of the arms in the summary, by the arms' own names.
    """

    fault: str
    arms: tuple[Arm, ...]
    summary: Summary
    names: dict[str, str]

    @classmethod
    def of(cls, episodes: Sequence[Episode]) -> Figures:
        """Sum up the episodes of a run; each is there once."""
        ran = [each for each in episodes if not each.record.error]
        faults = [each.record.fault for each in ran or episodes]
        fault = "" if "" in faults or not faults else faults[0]
        arms = arms_of(episodes, fault)
        records = [each.record for each in episodes if each.record.fault == fault]
        known = labels(Variant.of(record) for record in records)
        names = {
            arm.name: known[variant]
            for arm in arms
            for variant in known
            if (variant.policy, variant.planner, variant.perception)
            == (arm.policy, arm.planner, arm.perception)
        }
        return cls(fault, arms, summarise(records), names)

    @property
    def shown(self) -> tuple[Arm, ...]:
        """The arms that have episodes under the fault of the page."""
        return tuple(arm for arm in self.arms if arm.episodes)

    def whole(self, arm: Arm) -> SummaryRow:
        """All episodes of an arm."""
        return self._row(self.summary.policies, arm, "")

    def by_awareness(self, arm: Arm, kind: str) -> SummaryRow | None:
        """Those of an arm in which the person who came nearest was of that kind."""
        return self._find(self.summary.awareness, arm, kind)

    def by_scenario(self, arm: Arm, part: str) -> SummaryRow | None:
        """Those of an arm in a scenario, named as in the summary."""
        return self._find(self.summary.scenarios, arm, part)

    def against(self, arm: Arm, part: str = "", *, scenario: bool = False) -> Comparison | None:
        """An arm against the reference over pairs, in all, of an attention, or in a scenario."""
        comparisons = self.summary.comparisons
        if scenario:
            comparisons = self.summary.scenario_comparisons
        name = self.names.get(arm.name)
        return next((c for c in comparisons if (c.variant, c.part) == (name, part)), None)

    def _row(self, rows: Iterable[SummaryRow], arm: Arm, part: str) -> SummaryRow:
        row = self._find(rows, arm, part)
        assert row is not None
        return row

    def _find(self, rows: Iterable[SummaryRow], arm: Arm, part: str) -> SummaryRow | None:
        name = self.names.get(arm.name)
        return next((row for row in rows if (row.variant, row.part) == (name, part)), None)


def estimate(row: SummaryRow | None, measure: Measure) -> Interval:
    """A measure from a row; unknown without one."""
    if row is None:
        return Interval(np.nan, -np.inf, np.inf, 0)
    shares = {
        "robot_contacts": row.robot_contact,
        "person_contacts": row.person_contact,
        "success": row.success,
    }
    return shares[measure.key] if measure.share else row.means[measure.key]


def touched(record: EpisodeRecord) -> bool:
    """Whether the robot moved into a person."""
    return record.robot_contacts > 0 or record.contact_by == "robot"


def robot_contacts(episodes: Sequence[Episode]) -> Interval:
    """The share of episodes in which the robot moved into a person."""
    return proportion_interval(sum(touched(each.record) for each in episodes), len(episodes))
