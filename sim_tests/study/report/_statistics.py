"""The statistics of a report: the summary that ``awarenav compare`` prints, by arm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ..measures import (
    METRICS,
    Comparison,
    Interval,
    Metric,
    Summary,
    SummaryRow,
    Variant,
    labels,
    proportion_interval,
    summarise,
)
from ._arm import Arm, Episode, arms_of

TIME_LOST: Final = METRICS["time_lost_s"]
VIOLATION: Final = METRICS["violation_time_s"]
MARGIN: Final = METRICS["min_margin_m"]


@dataclass(frozen=True, slots=True)
class RunStatistics:
    """The statistics of a run, by arm.

    Attributes:
        fault: fault of the episodes in every section but the table of faults; empty for none,
            which is preferred.
        arms: in the order in which they are shown.
        summary: summary of the episodes under that fault.
        labels: labels of the arms in the summary, by the arms' own names.
    """

    fault: str
    arms: tuple[Arm, ...]
    summary: Summary
    labels: dict[str, str]

    @classmethod
    def of(cls, episodes: Sequence[Episode]) -> RunStatistics:
        """Return the statistics of the episodes of a run; each episode is there once."""
        ran = [each for each in episodes if not each.record.error]
        faults = [each.record.fault for each in ran or episodes]
        fault = "" if "" in faults or not faults else faults[0]
        arms = arms_of(episodes, fault)
        records = [each.record for each in episodes if each.record.fault == fault]
        label_of = labels(Variant.of(record) for record in records)
        arm_labels = {
            arm.name: label_of[variant]
            for arm in arms
            for variant in label_of
            if (variant.policy, variant.planner, variant.perception)
            == (arm.policy, arm.planner, arm.perception)
        }
        return cls(fault, arms, summarise(records), arm_labels)

    @property
    def shown(self) -> tuple[Arm, ...]:
        """The arms that have episodes under the fault of the report."""
        return tuple(arm for arm in self.arms if arm.episodes)

    def of_arm(self, arm: Arm) -> SummaryRow:
        """Return the row of all episodes of an arm."""
        row = self._find(self.summary.policies, arm, "")
        assert row is not None
        return row

    def by_awareness(self, arm: Arm, awareness: str) -> SummaryRow | None:
        """Return the row of an arm's episodes of one awareness class; None without any."""
        return self._find(self.summary.awareness, arm, awareness)

    def by_scenario(self, arm: Arm, scenario: str) -> SummaryRow | None:
        """Return the row of an arm's episodes in one scenario; None without any."""
        return self._find(self.summary.scenarios, arm, scenario)

    def against(self, arm: Arm, part: str = "", *, scenario: bool = False) -> Comparison | None:
        """Return the comparison of an arm with the reference; None without one.

        Args:
            arm: the arm.
            part: an attention, or a scenario; empty for all episodes.
            scenario: ``part`` is a scenario.
        """
        comparisons = self.summary.comparisons
        if scenario:
            comparisons = self.summary.scenario_comparisons
        label = self.labels.get(arm.name)
        return next((c for c in comparisons if (c.variant, c.part) == (label, part)), None)

    def _find(self, rows: Iterable[SummaryRow], arm: Arm, part: str) -> SummaryRow | None:
        label = self.labels.get(arm.name)
        return next((row for row in rows if (row.variant, row.part) == (label, part)), None)


def estimate(row: SummaryRow | None, metric: Metric) -> Interval:
    """Return a metric of a row; unknown without a row."""
    if row is None:
        return Interval(np.nan, -np.inf, np.inf, 0)
    shares = {
        "robot_contacts": row.robot_contact,
        "person_contacts": row.person_contact,
        "success": row.success,
    }
    return shares[metric.name] if metric.share else row.means[metric.name]


def robot_contacts(episodes: Sequence[Episode]) -> Interval:
    """Return the share of episodes in which the robot moved into a person."""
    return proportion_interval(sum(each.record.robot_touched for each in episodes), len(episodes))
