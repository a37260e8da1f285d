"""A summary of many episodes: one row per policy, split by scenario, awareness and attention."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Final

import numpy as np

from perception.short_repr import short_repr

from ...conditions import AXES, planner_name
from ._awareness import ATTENTIVE_FROM
from ._metrics import METRICS
from ._record import EpisodeRecord
from ._registry import RATIOS
from ._statistics import (
    Interval,
    paired,
    paired_difference,
    proportion_interval,
    ratio_intervals,
    violates_more,
)

#: Policy that others are compared with, unless another is named.
BASELINE: Final = "blind"
#: Part of the episodes labelled attentive whose people were not measured to be so.
UNCONFIRMED: Final = "unconfirmed"
_NO_FAULT: Final = "no fault"
# The conditions that have no field of their own in a variant.
_OTHERS: Final = tuple(
    name
    for name in AXES
    if name not in ("scenario", "seed", "policy", "planner", "perception", "fault")
)


@dataclass(frozen=True, slots=True)
class Variant:
    """One combination of what a run compares.

    Attributes:
        policy: name of the policy.
        planner: name of the planner.
        perception: ``"truth"``, ``"keypoints"``, ``"pixels"`` or ``"oracle"``.
        fault: name of the fault, empty for none.
        source: name of the table that its episodes come from, empty with a single table.
        others: other conditions that are not the scenario's own, such as ``("robot", "omni")``.
    """

    policy: str
    planner: str = ""
    perception: str = ""
    fault: str = ""
    source: str = ""
    others: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, record: EpisodeRecord, source: str = "") -> Variant:
        """Return the variant of an episode."""
        others = tuple((name, value) for name in _OTHERS if (value := getattr(record, name)))
        return cls(record.policy, record.planner, record.perception, record.fault, source, others)


def labels(variants: Iterable[Variant]) -> dict[Variant, str]:
    """Return a label for each variant: its policy, and the fields in which the policy's differ."""
    found = list(dict.fromkeys(variants))

    def label(variant: Variant) -> str:
        same = [each for each in found if each.policy == variant.policy]
        differing = [
            planner_name(getattr(variant, field)) or _NO_FAULT
            for field in ("planner", "perception", "fault", "source")
            if len({getattr(each, field) for each in same}) > 1
        ]
        differing += [
            f"{name} {value}"
            for name, value in variant.others
            if any((name, value) not in each.others for each in same)
        ]
        return ", ".join([variant.policy, *differing])

    return {variant: label(variant) for variant in found}


def baselines_of(variant: Variant, variants: Iterable[Variant], policy: str) -> tuple[Variant, ...]:
    """Return the variants that a variant is compared with.

    The first is the baseline policy with the same planner. Where there are several, the one under
    the most similar conditions is taken: the same table, then the same camera, robot and the like,
    then the same fault, then the same perception. The second is the same variant in the first of
    several tables.
    """
    known = tuple(variants)
    found: list[Variant] = []
    candidates = [
        each for each in known if each.policy == policy and each.planner == variant.planner
    ]
    if candidates and variant.policy != policy:
        found.append(
            max(
                candidates,
                key=lambda each: (
                    each.source == variant.source,
                    each.others == variant.others,
                    each.fault == variant.fault,
                    not each.fault,
                    each.perception == variant.perception,
                ),
            )
        )
    same = [replace(each, source="") for each in known]
    earlier = known[same.index(replace(variant, source=""))]
    if earlier != variant:
        found.append(earlier)
    return tuple(found)


_Part = Callable[[EpisodeRecord], str]
_Groups = Mapping[Variant, Sequence[EpisodeRecord]]


@dataclass(frozen=True, slots=True)
class Comparison:
    """One policy compared with the baseline over one part of the paired episodes.

    Attributes:
        variant: label of the policy.
        baseline: label of the policy compared with.
        part: a scenario or a part of :func:`measured_part`; empty for all.
        pairs: number of pairs.
        time_lost_s: mean difference in time lost, seconds a meeting; negative is faster.
        violation_excess: additional violation time, relative to that of the baseline.
        violation_excess_of_time: additional violation time, relative to the baseline's duration.
        violates_more: share of pairs in which the policy violates the margin longer.
        min_separation_m: mean difference in the smallest separation.
        step_out_never: mean difference in the step-out impacts, never noticed.
        step_out_all: the same of all step-out impacts.
    """

    variant: str
    baseline: str
    part: str
    pairs: int
    time_lost_s: Interval
    violation_excess: Interval
    violation_excess_of_time: Interval
    violates_more: Interval
    min_separation_m: Interval
    step_out_never: Interval
    step_out_all: Interval


@dataclass(frozen=True, slots=True, repr=False)
class SummaryRow:
    """One policy over one part of the episodes.

    Attributes:
        variant: label of the policy.
        part: a scenario, an awareness class or an attention; empty for all.
        episodes: number of episodes.
        errors: number of episodes that broke off with an error. They count as no success and enter
            no other figure.
        nondeterministic: number of episodes whose planner did not repeat itself.
        success: share of successes in all episodes.
        moving_contact: share of the episodes without an error in which a person and the moving
            robot touched, by any cause.
        robot_contact: share of them in which the robot moved into a person.
        person_contact: share of them in which a person walked into the robot.
        means: mean of each of :data:`METRICS` over the episodes to which it applies, and each of
            :data:`RATIOS` over all.
        worst: worst value of each metric, where it applies to an episode and has a better
            direction.
    """

    variant: str
    part: str
    episodes: int
    errors: int
    nondeterministic: int
    success: Interval
    moving_contact: Interval
    robot_contact: Interval
    person_contact: Interval
    means: Mapping[str, Interval]
    worst: Mapping[str, float]

    __repr__ = short_repr

    @property
    def asked(self) -> bool:
        """True if the robot asked somebody for attention."""
        return self.means["requests"].value > 0.0


@dataclass(frozen=True, slots=True, repr=False)
class Summary:
    """A summary of many episodes.

    Attributes:
        baseline: name of the policy compared with; empty when it has no episode.
        level: confidence of every interval.
        policies: one row per policy.
        scenarios: one row per policy and scenario.
        attentions: one row per policy and attention of the scenario.
        awareness: one row per policy and awareness class of the nearest person. The class depends
            on the policy's own run, so these rows are not paired across policies.
        comparisons: each policy compared with the baseline, and with itself in the first of several
            tables: over all episodes, then by attention.
    """

    baseline: str
    level: float
    policies: tuple[SummaryRow, ...]
    scenarios: tuple[SummaryRow, ...]
    attentions: tuple[SummaryRow, ...]
    awareness: tuple[SummaryRow, ...]
    comparisons: tuple[Comparison, ...]

    __repr__ = short_repr


def summarise(
    records: Iterable[EpisodeRecord],
    *,
    baseline: str = BASELINE,
    level: float = 0.95,
    seed: int = 0,
) -> Summary:
    """Return the summary of episodes; it does not depend on their order.

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
    """Return the summary of episodes of several tables by name, as :func:`summarise`.

    Each variant is also compared with itself in the first table.
    """
    rng = np.random.default_rng(seed)
    groups: dict[Variant, list[EpisodeRecord]] = {}
    for source, records in sources.items():
        for record in records:
            groups.setdefault(Variant.of(record, source), []).append(record)
    for group in groups.values():
        group.sort(key=attrgetter("task"))
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
    by_scenario = attrgetter("versioned_scenario")

    def rows(part_of: _Part) -> tuple[SummaryRow, ...]:
        return tuple(
            _summary_row(names[variant], part, chosen, level, rng)
            for part in _parts(ordered, part_of)
            for variant, group in ordered.items()
            if (chosen := [record for record in group if part_of(record) == part])
        )

    def comparisons(part_of: _Part) -> tuple[Comparison, ...]:
        return tuple(
            _comparison(
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
        scenarios=rows(by_scenario),
        attentions=rows(measured_part),
        awareness=rows(_awareness_part),
        comparisons=comparisons(lambda record: "") + comparisons(measured_part),
    )


def measured_part(record: EpisodeRecord) -> str:
    """Return the scenario's attention, or :data:`UNCONFIRMED`.

    An episode labelled attentive counts as such only if each of its people was aware for at least
    80 % of the time.
    """
    attention, share = str(record.attention), record.attentive_share
    if attention != "attentive" or record.error:
        return attention
    return "attentive" if share is not None and share >= ATTENTIVE_FROM else UNCONFIRMED


def _parts(groups: _Groups, part_of: _Part) -> list[str]:
    """Return every part that holds an episode."""
    return sorted({part_of(record) for group in groups.values() for record in group})


def _awareness_part(record: EpisodeRecord) -> str:
    return record.awareness or ("error" if record.error else "nobody near")


def _summary_row(
    variant: str,
    part: str,
    records: Sequence[EpisodeRecord],
    level: float,
    rng: np.random.Generator,
) -> SummaryRow:
    ran = [record for record in records if not record.error]
    values = [[getattr(record, name) for name in METRICS] for record in ran]
    table = np.array(values, dtype=np.float64).reshape(len(ran), len(METRICS))  # None becomes NaN
    present = np.isfinite(table)
    ratios = [
        [
            (each.factor * getattr(record, each.column), over)
            if (over := getattr(record, each.over)) is not None
            else (0.0, 0.0)
            for each in RATIOS.values()
        ]
        for record in ran
    ]
    parts = np.array(ratios, dtype=np.float64).reshape(len(ran), len(RATIOS), 2)
    intervals = ratio_intervals(
        np.hstack([np.where(present, table, 0.0), parts[..., 0]]),
        np.hstack([present.astype(np.float64), parts[..., 1]]),
        rng,
        level,
        strata=[record.task[:2] for record in ran],
    )
    worst = {}
    for metric, column, applies in zip(METRICS.values(), table.T, present.T, strict=True):
        if applies.any() and metric.better != "neither":
            worst_of = np.min if metric.better == "higher" else np.max
            worst[metric.name] = float(worst_of(column[applies]))
    return SummaryRow(
        variant=variant,
        part=part,
        episodes=len(records),
        errors=len(records) - len(ran),
        nondeterministic=sum(record.nondeterministic for record in ran),
        success=proportion_interval(sum(r.success for r in ran), len(records), level),
        moving_contact=proportion_interval(sum(r.moving_touched for r in ran), len(ran), level),
        robot_contact=proportion_interval(sum(r.robot_touched for r in ran), len(ran), level),
        person_contact=proportion_interval(sum(r.person_touched for r in ran), len(ran), level),
        means=dict(zip((*METRICS, *RATIOS), intervals, strict=True)),
        worst=worst,
    )


def _comparison(
    names: tuple[str, str, str],
    base: Sequence[EpisodeRecord],
    group: Sequence[EpisodeRecord],
    level: float,
    rng: np.random.Generator,
) -> Comparison:
    variant, baseline, part = names

    def change(field: str, over: str = "") -> Interval:
        return paired_difference(base, group, field, rng, level, over=over)

    return Comparison(
        variant=variant,
        baseline=baseline,
        part=part,
        pairs=len(paired(base, group)),
        time_lost_s=change("time_lost_s"),
        violation_excess=change("violation_time_s", "violation_time_s"),
        violation_excess_of_time=change("violation_time_s", "duration_s"),
        violates_more=violates_more(base, group, level),
        min_separation_m=change("min_separation_m"),
        step_out_never=change("step_out_never"),
        step_out_all=change("step_out_all"),
    )
