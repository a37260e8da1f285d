"""The figures of a comparison of planners: one score per planner and policy, and two probes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from ..measures import OVERSHOOT_MPS, Interval

#: Parts of the pairs by what people look at; empty for all pairs.
PARTS: Final = ("", "attentive", "unaware")


@dataclass(frozen=True, slots=True)
class Obedience:
    """Obedience to one limit.

    Attributes:
        excess_mps: the largest excess over the allowed speed; negative for always slower, None if
            it was not measured.
        broken: share of the episodes with an excess of more than :data:`OVERSHOOT_MPS`.
    """

    excess_mps: float | None
    broken: Interval

    @property
    def obeyed(self) -> bool | None:
        """True if no episode broke the limit; None if it was not measured."""
        return None if self.excess_mps is None else self.excess_mps <= OVERSHOOT_MPS


@dataclass(frozen=True, slots=True)
class PlanTime:
    """The elapsed time of ``plan``.

    Attributes:
        median_s: median over episodes of the median over the calls of an episode.
        p99_s: median over episodes of the 99th percentile of an episode.
        ratio: median over episodes of the median time, divided by the reference planner's in the
            same scenario with the same seed and policy; None without such pairs.
        late: whether ``p99_s`` is longer than the control cycle.
    """

    median_s: float
    p99_s: float
    ratio: float | None
    late: bool


@dataclass(frozen=True, slots=True)
class Score:
    """One planner with one policy.

    Attributes:
        planner: name of the planner.
        policy: name of the policy.
        episodes: number of episodes, the failed ones included.
        failed: number of episodes that ended with an error; they reached no goal, and enter no
            other figure.
        goals: share of all episodes that reached the goal.
        median_time_s: median time to goal of those.
        against_blind_s: mean difference of the time lost to that of the policy ``blind`` with the
            same planner, over pairs of episodes; negative is faster. By :data:`PARTS`.
        moving_contacts: share of episodes in which a person and the moving robot touched.
        robot_contacts: share of episodes in which the robot moved into a person.
        person_contacts: share of episodes in which a person walked into the robot.
        step_out_unaware: mean step-out impacts with unaware people, per 1 000 crossings.
        step_out_worst_mps: the robot's highest closing speed in one of them; None if not measured.
        worst_margin_m: smallest separation margin of all episodes; None if nobody came near.
        negative_margin: share of episodes with a negative margin.
        limit: obedience to ``speed_limit_mps``.
        fastest_point: obedience to ``fastest_point_limit_mps``, the yaw rule.
        plan_time: elapsed time of ``plan``; None if it was not measured.
    """

    planner: str
    policy: str
    episodes: int
    failed: int
    goals: Interval
    median_time_s: float | None
    against_blind_s: Mapping[str, Interval]
    moving_contacts: Interval
    robot_contacts: Interval
    person_contacts: Interval
    step_out_unaware: Interval
    step_out_worst_mps: float | None
    worst_margin_m: float | None
    negative_margin: Interval
    limit: Obedience
    fastest_point: Obedience
    plan_time: PlanTime | None


@dataclass(frozen=True, slots=True)
class RadiiUse:
    """The effect of wider radii with everything else the same.

    Attributes:
        changed: share of pairs of episodes in which the path or the distance kept is another.
        separation_m: mean difference of the smallest separation.
        near: number of pairs in which the robot came into a wider circle. Only these show that a
            planner does not use radii.
    """

    changed: Interval
    separation_m: Interval
    near: int


@dataclass(frozen=True, slots=True)
class FieldUse:
    """The effect of the speed field, with the policy that verdicts speak of.

    Attributes:
        time_s: mean difference of the time to goal, with the field minus without it, over pairs of
            episodes. One that does not reach its goal counts with all of its time.
        goals_with: share of episodes that reach the goal with the field.
        goals_without: share of episodes that do without it.
    """

    time_s: Interval
    goals_with: Interval
    goals_without: Interval


@dataclass(frozen=True, slots=True)
class Failure:
    """An error that ended episodes of a planner.

    Attributes:
        message: the error.
        times: number of episodes that it ended.
        episode: number of the first of them, as ``awarenav replay`` takes it.
    """

    message: str
    times: int
    episode: int


@dataclass(frozen=True, slots=True)
class PlannerScore:
    """One planner.

    Attributes:
        name: name on the page.
        planner: name as it was given.
        scores: one per policy, in the order of the comparison.
        radii: effect of wider radii; None for variants.
        field: effect of the speed field; None for a planner that does not use it, and for variants.
        failures: the errors of its episodes, the most frequent first.
        repeats: False if it gave other commands when it drove a task a second time.
        variant_of: name of the planner that it is a variant of; empty for none.
    """

    name: str
    planner: str
    scores: tuple[Score, ...]
    radii: RadiiUse | None
    field: FieldUse | None
    failures: tuple[Failure, ...]
    repeats: bool
    variant_of: str = ""

    def with_policy(self, policy: str) -> Score | None:
        """Return the score with a policy; None if it did not run with it."""
        return next((each for each in self.scores if each.policy == policy), None)


@dataclass(frozen=True, slots=True)
class Scorecard:
    """A comparison of planners.

    Attributes:
        planners: the planners, the reference planner first, each followed by its variant.
        policy: name of the policy that verdicts speak of.
        wide_policy: name of that policy with wider radii.
        scenarios: names of the scenarios.
        seeds: the seeds.
        perception: how the robots perceived people.
        episodes: number of episodes that have ended.
        planned: number of episodes of the comparison.
        command: the command line; empty if it was made from Python.
    """

    planners: tuple[PlannerScore, ...]
    policy: str
    wide_policy: str
    scenarios: tuple[str, ...]
    seeds: tuple[int, ...]
    perception: str
    episodes: int
    planned: int
    command: str
