"""The scorecard of a folder: the figures of the episodes that have ended in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M

from ...world.errors import SimError
from ..measures import (
    BASELINE,
    OVERSHOOT_MPS,
    Conduct,
    EpisodeRecord,
    Interval,
    bootstrap_interval,
    measured_part,
    paired,
    paired_difference,
    proportion_interval,
)
from ..runs import job_key, policy_of, read_attempts, read_jobs, read_run
from ._plan import REFERENCE, ComparisonPlan, Entrant
from ._score import (
    PARTS,
    Failure,
    FieldUse,
    Obedience,
    PlannerScore,
    PlanTime,
    RadiiUse,
    Score,
    Scorecard,
)

#: Paths or distances that differ by less count as the same.
SAME_PATH_M: Final = 0.01


@dataclass(frozen=True, slots=True)
class _Episode:
    """An episode that has ended: its number, its row, and its conduct if that is known."""

    number: int
    record: EpisodeRecord
    conduct: Conduct | None

    @property
    def task(self) -> tuple[str, int]:
        return self.record.scenario, self.record.seed


_Group = Sequence[_Episode]


def read_scorecard(folder: Path) -> Scorecard:
    """Return the scorecard of a comparison, finished or not.

    Args:
        folder: folder of the comparison.

    Raises:
        SimError: it holds no comparison, or a file of it cannot be read.
    """
    plan, jobs = ComparisonPlan.read(folder), read_jobs(folder)
    groups: dict[tuple[str, str], list[_Episode]] = {}
    attempts = read_attempts(folder)
    if not attempts:
        raise SimError(f"{folder} holds no episode yet")
    records = [attempts[number].record for number in sorted(attempts)]
    for number in sorted(attempts):
        record = attempts[number].record
        episode = _Episode(number, record, attempts[number].conduct)
        groups.setdefault((record.planner, record.policy), []).append(episode)
    reference = next(each.label for each in plan.entrants if each.planner == REFERENCE)
    first = [job_key(job) for job in jobs]
    wide = next(job.policy for job in jobs if job.policy_name == plan.wide_policy)
    widest_m = policy_of(wide).inflation.radius_m(0.0)
    return Scorecard(
        tuple(_planner_score(plan, each, groups, reference, widest_m) for each in plan.entrants),
        plan.probed_policy,
        plan.wide_policy,
        tuple(dict.fromkeys(key.scenario for key in first)),
        tuple(sorted({key.seed for key in first})),
        next((key.perception for key in first if key.policy == BASELINE), ""),
        len(records),
        len(jobs),
        str(read_run(folder).get("command", "")),
    )


def _planner_score(
    plan: ComparisonPlan,
    entrant: Entrant,
    groups: Mapping[tuple[str, str], _Group],
    reference: str,
    widest_m: float,
) -> PlannerScore:
    """Return the score of a planner.

    Args:
        plan: the plan of the comparison.
        entrant: the planner.
        groups: the episodes by the planner's label and the policy's name.
        reference: label of the reference planner.
        widest_m: radius of an unaware person in the probe of radii.
    """

    def group(policy: str, label: str = entrant.label) -> _Group:
        return groups.get((label, policy), ())

    own = [each for policy in (*plan.policies, plan.wide_policy) for each in group(policy)]
    variant = next((each for each in plan.entrants if each.variant_of == entrant.name), None)
    field = None
    if variant is not None:
        pair = (group(plan.probed_policy), group(plan.probed_policy, variant.label))
        field = _field_use(*(pair if entrant.speed_field else pair[::-1]))
    return PlannerScore(
        entrant.name,
        entrant.planner,
        tuple(
            _score(entrant.name, policy, found, group(BASELINE), group(policy, reference))
            for policy in plan.policies
            if (found := group(policy))
        ),
        None
        if entrant.variant_of
        else _radii_use(group(plan.probed_policy), group(plan.wide_policy), widest_m),
        field,
        _failures(own),
        not any(each.record.nondeterministic for each in own),
        entrant.variant_of,
    )


def _score(planner: str, policy: str, group: _Group, blind: _Group, reference: _Group) -> Score:
    ran = [each for each in group if not each.record.error]
    records = [each.record for each in ran]
    times = [each.time_to_goal_s for each in records if each.time_to_goal_s is not None]
    margins = [each.min_margin_m for each in records if each.min_margin_m is not None]
    conducts = [each.conduct for each in ran if each.conduct is not None]
    return Score(
        planner,
        policy,
        len(group),
        len(group) - len(ran),
        proportion_interval(len(times), len(group)),
        median(times) if times else None,
        {part: _against(blind, group, part) for part in PARTS},
        _share(records, lambda each: each.moving_touched),
        _share(records, lambda each: each.robot_touched),
        _share(records, lambda each: each.person_touched),
        _step_out(records),
        max(
            (each.step_out_worst_mps for each in records if each.step_out_worst_mps is not None),
            default=None,
        ),
        min(margins, default=None),
        _share(records, lambda each: each.min_margin_m is not None and each.min_margin_m < 0.0),
        _obedience([each.limit_excess_mps for each in conducts]),
        _obedience([each.fastest_point_excess_mps for each in conducts]),
        _plan_time(ran, reference),
    )


def _share(records: Sequence[EpisodeRecord], is_so: Callable[[EpisodeRecord], bool]) -> Interval:
    return proportion_interval(sum(map(is_so, records)), len(records))


def _step_out(records: Sequence[EpisodeRecord]) -> Interval:
    """Return the mean step-out impacts with unaware people, over the episodes with people."""
    known = [each for each in records if each.step_out_unaware is not None]
    return bootstrap_interval(
        [each.step_out_unaware for each in known],
        np.random.default_rng(0),
        strata=[each.scenario for each in known],
    )


def _against(blind: _Group, group: _Group, part: str) -> Interval:
    """Return the mean difference of the time lost to ``blind``, over one part of the pairs."""

    def chosen(episodes: _Group) -> list[EpisodeRecord]:
        records = [each.record for each in episodes]
        return [each for each in records if not part or measured_part(each) == part]

    return paired_difference(chosen(blind), chosen(group), "time_lost_s")


def _obedience(excesses: Iterable[float | None]) -> Obedience:
    known = [each for each in excesses if each is not None]
    broken = sum(each > OVERSHOOT_MPS for each in known)
    return Obedience(max(known, default=None), proportion_interval(broken, len(known)))


def _plan_time(ran: _Group, reference: _Group) -> PlanTime | None:
    known = [(each.task, each.conduct) for each in ran if each.conduct is not None]
    if not known:
        return None
    peers = {each.task: each.conduct for each in reference if each.conduct is not None}
    ratios = [
        conduct.plan_median_s / peers[task].plan_median_s
        for task, conduct in known
        if task in peers and peers[task].plan_median_s > 0.0
    ]
    p99_s = median(conduct.plan_p99_s for _, conduct in known)
    return PlanTime(
        median(conduct.plan_median_s for _, conduct in known),
        p99_s,
        median(ratios) if ratios else None,
        p99_s > median(conduct.cycle_s for _, conduct in known),
    )


def _radii_use(group: _Group, wide: _Group, widest_m: float) -> RadiiUse | None:
    """Return the effect of wider radii; None if no pair of episodes has ended."""
    pairs = [
        pair
        for pair in paired([each.record for each in group], [each.record for each in wide])
        if not any(each.error for each in pair)
    ]
    if not pairs:
        return None
    changed = sum(_differs(*pair) for pair in pairs)
    before, after = zip(*pairs, strict=True)
    gaps_m = [each.min_separation_m for each in before if each.min_separation_m is not None]
    return RadiiUse(
        proportion_interval(changed, len(pairs)),
        paired_difference(before, after, "min_separation_m"),
        sum(gap_m < widest_m - BODY_RADIUS_M for gap_m in gaps_m),
    )


def _differs(one: EpisodeRecord, other: EpisodeRecord) -> bool:
    """Return whether two episodes have another path: its length, or the distance kept, differs."""
    if (one.time_to_goal_s is None) != (other.time_to_goal_s is None):
        return True
    for name in ("path_length_m", "min_separation_m"):
        first, second = getattr(one, name), getattr(other, name)
        if (first is None) != (second is None):
            return True
        if first is not None and abs(first - second) > SAME_PATH_M:
            return True
    return False


def _field_use(with_field: _Group, without: _Group) -> FieldUse:
    def goals(group: _Group) -> Interval:
        arrived = sum(each.record.time_to_goal_s is not None for each in group)
        return proportion_interval(arrived, len(group))

    records = [[each.record for each in group] for group in (without, with_field)]
    pairs = [pair for pair in paired(*records) if not any(each.error for each in pair)]
    return FieldUse(
        bootstrap_interval(
            [_taken_s(after) - _taken_s(before) for before, after in pairs],
            np.random.default_rng(0),
            strata=[before.scenario for before, _ in pairs],
        ),
        goals(with_field),
        goals(without),
    )


def _taken_s(record: EpisodeRecord) -> float:
    """Return the time to goal, or all of the time of an episode that did not reach it."""
    if record.time_to_goal_s is not None:
        return record.time_to_goal_s
    return record.duration_s or 0.0


def _failures(episodes: Iterable[_Episode]) -> tuple[Failure, ...]:
    failed = [each for each in episodes if each.record.error]
    first: dict[str, int] = {}
    for each in failed:
        first.setdefault(each.record.error, each.number)
    times = Counter(each.record.error for each in failed)
    return tuple(Failure(text, number, first[text]) for text, number in times.most_common())
