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
    measured_part,
    paired,
    proportion_interval,
    summarise,
)
from ._arm import Arm, Episode, arms_of

TIME_LOST: Final = METRICS["time_lost_s"]
VIOLATION: Final = METRICS["violation_time_s"]
MARGIN: Final = METRICS["min_margin_m"]


@dataclass(frozen=True, slots=True)
class Unconfirmed:
    """The pairs of a scenario labelled attentive that do not count as attentive.

    Attributes:
        scenario: name, with the version from 2 on.
        pairs: number of all its pairs.
        inattentive: number of pairs in which somebody was measured not to be attentive.
        not_measured: number of pairs in which attention was not measured.
    """

    scenario: str
    pairs: int
    inattentive: int
    not_measured: int

    @property
    def left_out(self) -> int:
        """Number of pairs that do not count."""
        return self.inattentive + self.not_measured


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
            part: a part of :func:`measured_part`, or a scenario; empty for all episodes.
            scenario: ``part`` is a scenario.
        """
        comparisons = self.summary.comparisons
        if scenario:
            comparisons = self.summary.scenario_comparisons
        label = self.labels.get(arm.name)
        return next((c for c in comparisons if (c.variant, c.part) == (label, part)), None)

    def unconfirmed(self, arm: Arm) -> tuple[Unconfirmed, ...]:
        """Return the pairs with the reference that count as attentive by their label alone.

        In each of them somebody was not attentive in one of its two episodes, or it was not
        measured.
        """
        whole = self.against(arm)
        if whole is None:
            return ()
        base = next(each for each in self.arms if self.labels.get(each.name) == whole.baseline)
        found: dict[str, Unconfirmed] = {}
        for pair in paired(*([each.record for each in part.episodes] for part in (base, arm))):
            if pair[0].attention != "attentive":
                continue
            name = pair[0].versioned_scenario
            old = found.get(name, Unconfirmed(name, 0, 0, 0))
            unknown = any(each.attentive_share is None for each in pair)
            counts = all(measured_part(each) == "attentive" for each in pair)
            found[name] = Unconfirmed(
                name,
                old.pairs + 1,
                old.inattentive + (not counts and not unknown),
                old.not_measured + unknown,
            )
        return tuple(each for each in found.values() if each.left_out)

    def _find(self, rows: Iterable[SummaryRow], arm: Arm, part: str) -> SummaryRow | None:
        label = self.labels.get(arm.name)
        return next((row for row in rows if (row.variant, row.part) == (label, part)), None)


def estimate(row: SummaryRow | None, metric: Metric) -> Interval:
    """Return a metric of a row; unknown without a row."""
    if row is None:
        return Interval(np.nan, -np.inf, np.inf, 0)
    shares = {
        "moving_contacts": row.moving_contact,
        "robot_contacts": row.robot_contact,
        "person_contacts": row.person_contact,
        "success": row.success,
    }
    is_of_episodes = metric.share and metric.name in shares
    return shares[metric.name] if is_of_episodes else row.means[metric.name]


def moving_contacts(episodes: Sequence[Episode]) -> Interval:
    """Return the share of episodes in which a person and the moving robot touched."""
    return proportion_interval(sum(each.record.moving_touched for each in episodes), len(episodes))
