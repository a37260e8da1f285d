"""One policy against another on the same scenarios and seeds.

One policy over one part of the episodes.

Many episodes summed up: a row a policy, split by scenario, awareness and attention.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ._bootstrap import ratio_intervals
from ._interval import Interval, proportion_interval
from ._metric_info import METRICS
from ._pairs import (
    paired,
    paired_difference,
    violates_more,
    violation_excess,
    violation_excess_of_time,
    won_back,
)
from ._record import EpisodeRecord
from ._variants import Variant, baselines_of, labels


@dataclass(frozen=True, slots=True)
class Comparison:
    """One policy against the baseline over one part of the paired episodes.

    Attributes:
        variant: the policy.
        baseline: compared with.
        part: a scenario or an attention; empty for all.
        pairs: how many.
        won_back: share of the time lost by the baseline that is won back.
        time_lost_s: mean difference to the baseline; negative is faster.
        violation_excess: longer violation of the margin, relative to that of the baseline.
        violation_excess_of_time: the same relative to the baseline's duration.
        violates_more: share of pairs with a longer violation.
        min_separation_m: mean difference of the smallest separation.
    """

    variant: str
    baseline: str
    part: str
    pairs: int
    won_back: Interval
    time_lost_s: Interval
    violation_excess: Interval
    violation_excess_of_time: Interval
    violates_more: Interval
    min_separation_m: Interval


@dataclass(frozen=True, slots=True)
class SummaryRow:
    """One policy over one part of the episodes.

    Attributes:
        variant: the policy, and what else tells it from others.
        part: of the episodes: a scenario, an awareness class, an attention; empty for all.
        episodes: how many.
        errors: of them, those that broke off with an error: no success, and in no other figure.
        success: share of all episodes.
        robot_contact: share of the episodes that ran in which the robot moved into somebody.
        person_contact: share in which somebody walked into the robot.
        means: mean of each of :data:`METRICS` over the episodes to which it applies.
        worst: the worst value of each that occurred; without those that occurred nowhere, and
            those of which neither way is worse.
    """

    variant: str
    part: str
    episodes: int
    errors: int
    success: Interval
    robot_contact: Interval
    person_contact: Interval
    means: Mapping[str, Interval]
    worst: Mapping[str, float]


#: Compared with unless another is named.
BASELINE: Final = "blind"

_Part = Callable[[EpisodeRecord], str]
_Groups = Mapping[Variant, Sequence[EpisodeRecord]]


@dataclass(frozen=True, slots=True)
class Summary:
    """Many episodes summed up.

    Attributes:
        baseline: name of the policy compared with; empty when no episode is of it.
        level: of every interval.
        policies: a row a policy.
        scenarios: a row a policy and scenario.
        attentions: a row a policy and attention of the scenario.
        awareness: a row a policy and class of the person who came nearest. A class depends on what
            the policy's own run made of that person: not paired across policies.
        comparisons: each policy against the baseline, and against itself in the first of several
            tables: over all, then by attention.
        scenario_comparisons: the same by scenario.
    """

    baseline: str
    level: float
    policies: tuple[SummaryRow, ...]
    scenarios: tuple[SummaryRow, ...]
    attentions: tuple[SummaryRow, ...]
    awareness: tuple[SummaryRow, ...]
    comparisons: tuple[Comparison, ...]
    scenario_comparisons: tuple[Comparison, ...]


def summarise(
    records: Iterable[EpisodeRecord],
    *,
    baseline: str = BASELINE,
    level: float = 0.95,
    seed: int = 0,
) -> Summary:
    """Sum up episodes; the result does not depend on their order.

    Args:
        records: of any policies, scenarios and seeds.
        baseline: name of the policy that others are compared with.
        level: of the intervals.
        seed: of the bootstrap.

    Raises:
        SimError: an episode is there twice.
    """
    return summarise_sources({"": tuple(records)}, baseline=baseline, level=level, seed=seed)


def summarise_sources(
    sources: Mapping[str, Sequence[EpisodeRecord]],
    *,
    baseline: str = BASELINE,
    level: float = 0.95,
    seed: int = 0,
) -> Summary:
    """Sum up episodes of several tables, as :func:`summarise`.

    Args:
        sources: records by the name of their table; with several, each variant is also compared
            with itself in the first.
        baseline: as in :func:`summarise`.
        level: as in :func:`summarise`.
        seed: as in :func:`summarise`.
    """
    rng = np.random.default_rng(seed)
    groups: dict[Variant, list[EpisodeRecord]] = {}
    for source, records in sources.items():
        for record in records:
            groups.setdefault(Variant.of(record, source), []).append(record)
    for group in groups.values():
        group.sort(key=_order)
    ordered = {
        variant: groups[variant]
        for variant in sorted(
            groups,
            key=lambda each: (
                each.policy != baseline,
                each.policy,
                each.fault,
                each.perception,
                each.planner,
                tuple(sources).index(each.source),
            ),
        )
    }
    names = labels(ordered)

    def rows(part_of: _Part) -> tuple[SummaryRow, ...]:
        return tuple(
            _row(names[variant], part, chosen, level, rng)
            for part in _parts(ordered, part_of)
            for variant, group in ordered.items()
            if (chosen := [record for record in group if part_of(record) == part])
        )

    def comparisons(part_of: _Part) -> tuple[Comparison, ...]:
        return tuple(
            _compare(
                (names[variant], names[base], part),
                [record for record in ordered[base] if part_of(record) == part],
                [record for record in group if part_of(record) == part],
                level,
                rng,
            )
            for part in _parts(ordered, part_of)
            for variant, group in ordered.items()
            if any(part_of(record) == part for record in group)
            for base in baselines_of(variant, ordered, baseline)
        )

    return Summary(
        baseline=baseline if any(each.policy == baseline for each in ordered) else "",
        level=level,
        policies=rows(lambda record: ""),
        scenarios=rows(_scenario),
        attentions=rows(lambda record: record.attention),
        awareness=rows(_awareness),
        comparisons=comparisons(lambda record: "") + comparisons(lambda record: record.attention),
        scenario_comparisons=comparisons(_scenario),
    )


def _order(record: EpisodeRecord) -> tuple[str, int, int]:
    return record.scenario, record.scenario_version, record.seed


def _parts(groups: _Groups, part_of: _Part) -> list[str]:
    return sorted({part_of(record) for group in groups.values() for record in group})


def _scenario(record: EpisodeRecord) -> str:
    version = "" if record.scenario_version == 1 else f" v{record.scenario_version}"
    return record.scenario + version


def _awareness(record: EpisodeRecord) -> str:
    return record.awareness or ("error" if record.error else "nobody near")


def _row(
    variant: str,
    part: str,
    records: Sequence[EpisodeRecord],
    level: float,
    rng: np.random.Generator,
) -> SummaryRow:
    ran = [record for record in records if not record.error]
    values = [[getattr(record, metric.name) for metric in METRICS] for record in ran]
    table = np.array(values, dtype=np.float64).reshape(len(ran), len(METRICS))  # None becomes NaN
    present = np.isfinite(table)
    intervals = ratio_intervals(
        np.where(present, table, 0.0),
        present.astype(np.float64),
        rng,
        level,
        strata=[(record.scenario, record.scenario_version) for record in ran],
    )
    worst = {}
    for metric, column, there in zip(METRICS, table.T, present.T, strict=True):
        if there.any() and metric.better != "neither":
            pick = np.min if metric.better == "higher" else np.max
            worst[metric.name] = float(pick(column[there]))
    return SummaryRow(
        variant=variant,
        part=part,
        episodes=len(records),
        errors=len(records) - len(ran),
        success=proportion_interval(sum(r.success for r in ran), len(records), level),
        robot_contact=proportion_interval(
            sum(r.robot_contacts > 0 or r.contact_by == "robot" for r in ran), len(ran), level
        ),
        person_contact=proportion_interval(
            sum(r.person_contacts > 0 or r.contact_by == "person" for r in ran), len(ran), level
        ),
        means={metric.name: interval for metric, interval in zip(METRICS, intervals, strict=True)},
        worst=worst,
    )


def _compare(
    names: tuple[str, str, str],
    base: Sequence[EpisodeRecord],
    group: Sequence[EpisodeRecord],
    level: float,
    rng: np.random.Generator,
) -> Comparison:
    variant, baseline, part = names
    return Comparison(
        variant=variant,
        baseline=baseline,
        part=part,
        pairs=len(paired(base, group)),
        won_back=won_back(base, group, rng, level),
        time_lost_s=paired_difference(base, group, "time_lost_s", rng, level),
        violation_excess=violation_excess(base, group, rng, level),
        violation_excess_of_time=violation_excess_of_time(base, group, rng, level),
        violates_more=violates_more(base, group, level),
        min_separation_m=paired_difference(base, group, "min_separation_m", rng, level),
    )
