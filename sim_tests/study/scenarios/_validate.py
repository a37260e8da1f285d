"""The work of ``awarenav scenario validate``: a scenario's draws, and its people's attention."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from tqdm import tqdm

from awarenav.errors import counted
from nav_adapter import AwarenessPolicy

from ...scenario import Scenario
from ...scenario.catalogue import (
    CHECKED_DRAWS,
    CONFLICT_M,
    approach_statistics,
    drawn_problems,
    names_of_sets,
)
from ...world.errors import MissingSimulatorError, SimError
from ..measures import ATTENTION_WITHIN_M, ATTENTIVE_FROM, UNAWARE_UP_TO, MeasuredAttention

if TYPE_CHECKING:
    from ...crossing import CrossingResult

# Nobody who is aware for less of the time has noticed the robot.
_NEVER: Final = 0.02
# A scenario with a smaller share of conflicts than this tests little.
_MIN_CONFLICT_SHARE: Final = 0.8
_WRONG_LABEL, _CANNOT_RUN = 1, 2


def validate_command(files: Sequence[str], episodes: int) -> int:
    """Check scenarios and print what is wrong.

    Returns:
        0; 1 if a scenario's people contradict its ``attention``; 2 if one cannot be run.
    """
    return max(_validate(file, episodes) for file in names_of_sets(files))


def _validate(file: str, episodes: int) -> int:
    try:
        scenario = Scenario.named(file)
        found = drawn_problems(scenario)
    except SimError as error:
        print(f"{file}: cannot be run\n  {error}")
        return _CANNOT_RUN
    if found:
        print(f"{file}: cannot be run")
        print("\n".join(f"  {problem}" for problem in found))
        return _CANNOT_RUN
    approach = _approach_remark(scenario)
    wrong, remarks = ((), ()) if approach is None else _attention_findings(scenario, episodes)
    varying = counted(len(scenario.distributions), "number varies", "numbers vary")
    verdict = "can be run, but its attention is wrong" if wrong else "can be run"
    print(f"{file}: {scenario.id}, {varying}: {verdict}")
    people = "it has no people, or only those of replay_csv" if approach is None else approach
    for line in (*wrong, people, *remarks):
        print(f"  {line}")
    return _WRONG_LABEL if wrong else 0


def _approach_remark(scenario: Scenario) -> str | None:
    """Return how often robot and people would meet; None without planned people."""
    statistics = approach_statistics(scenario, CHECKED_DRAWS)
    if statistics is None:
        return None
    remark = (
        f"if nobody reacted, robot and somebody would be nearer than {CONFLICT_M:g} m in "
        f"{statistics.conflict_share:.0%} of {counted(statistics.draws, 'draw')}"
    )
    if statistics.conflict_share < _MIN_CONFLICT_SHARE:
        remark += ": it hardly tests the robot; let people start earlier or later"
    return remark


def _attention_findings(
    scenario: Scenario, episodes: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what contradicts the scenario's ``attention``, and what was measured."""
    if not episodes:
        return (), ()
    seeds = tqdm(
        range(episodes),
        desc=scenario.name,
        unit="crossing",
        disable=None,
        leave=False,
        file=sys.stderr,
    )
    try:
        check = check_attention(scenario, seeds)
    except MissingSimulatorError as error:
        return (), (f"what people look at was not measured: {error}",)
    return check.contradictions, check.remarks


@dataclass(frozen=True, slots=True)
class PersonAttention:
    """The attention of one person in all crossings together.

    Attributes:
        name: name of the person.
        could_look_s: seconds with the robot in front, in sight and within 5 m.
        aware_share: share of these in which they looked at it, or had within 1 s.
        looked_share: share of these in which they looked at it.
    """

    name: str
    could_look_s: float
    aware_share: float
    looked_share: float


@dataclass(frozen=True, slots=True)
class AttentionCheck:
    """The label of a scenario, and the attention of its people."""

    label: str
    crossings: int
    people: tuple[PersonAttention, ...]

    @classmethod
    def of(cls, scenario: Scenario, results: Iterable[CrossingResult]) -> AttentionCheck:
        """Return the check of a scenario by crossings of it."""
        measured = [MeasuredAttention.of(result) for result in results]
        names = _names(scenario, measured)
        return cls(scenario.attention, len(measured), _people(names, measured))

    @property
    def contradictions(self) -> tuple[str, ...]:
        """One sentence for each person who contradicts the label."""
        if self.label == "attentive":
            return tuple(
                f"attention: attentive, but {each.name} had looked at the robot within 1 s for "
                f"{each.aware_share:.0%} of {each.could_look_s:.1f} s; attentive people are for at "
                f"least {ATTENTIVE_FROM:.0%}"
                for each in self.people
                if each.aware_share < ATTENTIVE_FROM
            )
        if self.label == "unaware":
            return tuple(
                f"attention: unaware, but {each.name} looked at the robot for "
                f"{each.looked_share:.0%} of {each.could_look_s:.1f} s; unaware people do for at "
                f"most {UNAWARE_UP_TO:.0%}"
                for each in self.people
                if each.looked_share > UNAWARE_UP_TO
            )
        return ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """The figures that were measured, and a label that would fit better."""
        crossings = counted(self.crossings, "crossing")
        if not self.people:
            return (
                f"in {crossings}, nobody had the robot in front of them within "
                f"{ATTENTION_WITHIN_M:g} m: the attention could not be measured",
            )
        shares = "; ".join(
            f"{each.name} looking at it for {each.looked_share:.0%}, or within 1 s for "
            f"{each.aware_share:.0%} of {each.could_look_s:.1f} s"
            for each in self.people
        )
        found = [
            f"in {crossings}, with the robot in front within {ATTENTION_WITHIN_M:g} m: {shares}"
        ]
        if self.label == "mixed":
            looks = [each.looked_share for each in self.people]
            if min(looks) >= ATTENTIVE_FROM:
                found.append("everybody watches the robot: its attention could be attentive")
            elif max(each.aware_share for each in self.people) <= _NEVER:
                found.append("nobody is aware of the robot: its attention could be unaware")
        return tuple(found)


def check_attention(scenario: Scenario, seeds: Iterable[int]) -> AttentionCheck:
    """Run a scenario with perfect perception and return what its people looked at.

    Raises:
        MissingSimulatorError: the extra ``sim`` is missing.
    """
    from ...crossing import run_crossing  # noqa: PLC0415 - needs the extra sim

    # Nobody is asked to look: what people do by themselves counts.
    policy = AwarenessPolicy.preset("balanced").model_copy(update={"attention": None})
    return AttentionCheck.of(
        scenario,
        (
            run_crossing(scenario.draw(seed), policy=policy, perception="truth", seed=seed)
            for seed in seeds
        ),
    )


def _names(scenario: Scenario, measured: Sequence[MeasuredAttention]) -> list[str]:
    names = [person.name for person in scenario.people]
    everybody = max((len(each.could_look_s) for each in measured), default=0)
    return names + [f"recorded person {number}" for number in range(everybody - len(names))]


def _people(
    names: Sequence[str], measured: Sequence[MeasuredAttention]
) -> tuple[PersonAttention, ...]:
    """Return the people who could look at the robot, with their times of all crossings together."""
    people = []
    for index, name in enumerate(names):
        judged = [each for each in measured if each.judged[index]]
        could_look_s = sum(float(each.could_look_s[index]) for each in judged)
        if could_look_s > 0.0:
            aware_s = sum(float(each.aware_s[index]) for each in judged)
            looked_s = sum(float(each.looked_s[index]) for each in judged)
            people.append(
                PersonAttention(name, could_look_s, aware_s / could_look_s, looked_s / could_look_s)
            )
    return tuple(people)
