"""A scenario's ``attention`` checked against what its people look at in crossings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from awarenav.errors import counted
from nav_adapter import AwarenessPolicy

from ...crossing import CrossingResult, run_crossing
from ...scenario import Scenario, ScenarioTemplate
from ..measures import (
    ATTENTION_WITHIN_M,
    ATTENTIVE_FROM,
    UNAWARE_UP_TO,
    MeasuredAttention,
    Trace,
)

# Nobody is asked to look: what people do by themselves counts.
_POLICY: Final = AwarenessPolicy.preset("balanced").model_copy(update={"attention": None})
# Nobody who is aware for less of the time has noticed the robot.
_NEVER: Final = 0.02


@dataclass(frozen=True, slots=True)
class PersonAttention:
    """The attention of one person in all crossings together.

    Attributes:
        name: name of the person.
        could_look_s: seconds with the robot in front, in sight and within 5 m.
        aware_share: share of these with a true α ≥ 0.5.
        looked_share: share of these with a gaze straight at the robot, α ≥ 0.9.
    """

    name: str
    could_look_s: float
    aware_share: float
    looked_share: float


@dataclass(frozen=True, slots=True)
class AttentionCheck:
    """The label of a scenario, and the attention of its people.

    Attributes:
        label: the scenario's ``attention``.
        crossings: number of crossings.
        people: the people who had the robot before them for half a second or more.
    """

    label: str
    crossings: int
    people: tuple[PersonAttention, ...]

    @classmethod
    def of(cls, template: ScenarioTemplate, results: Iterable[CrossingResult]) -> AttentionCheck:
        """Return the check of a scenario by crossings of it."""
        measured = [MeasuredAttention.of(Trace.of(result)) for result in results]
        names = _names(template.median(), measured)
        return cls(template.attention, len(measured), tuple(_people(names, measured)))

    @property
    def contradictions(self) -> tuple[str, ...]:
        """One sentence for each person who contradicts the label."""
        if self.label == "attentive":
            return tuple(
                f"attention: attentive, but {each.name} was aware of the robot (α ≥ 0.5) for "
                f"{each.aware_share:.0%} of {each.could_look_s:.1f} s; attentive people are for at "
                f"least {ATTENTIVE_FROM:.0%}"
                for each in self.people
                if each.aware_share < ATTENTIVE_FROM
            )
        if self.label == "unaware":
            return tuple(
                f"attention: unaware, but {each.name} looked straight at the robot (α ≥ 0.9) for "
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
            f"{each.name} aware (α ≥ 0.5) for {each.aware_share:.0%}, looking straight at it for "
            f"{each.looked_share:.0%} of {each.could_look_s:.1f} s"
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
        if self.label == "unaware":
            found += [
                f"{each.name} does not watch the robot, but has it in the attention cone for "
                f"{each.aware_share:.0%} of the time: it may take them for aware"
                for each in self.people
                if each.looked_share <= UNAWARE_UP_TO < each.aware_share
            ]
        return tuple(found)


def check_attention(template: ScenarioTemplate, seeds: Iterable[int]) -> AttentionCheck:
    """Run a scenario with perfect perception and return what its people looked at.

    Args:
        template: the scenario; with the policy ``balanced``, which asks nobody.
        seeds: one crossing each.
    """

    def results() -> Iterator[CrossingResult]:
        for seed in seeds:
            scenario = template.for_seed(seed)
            yield run_crossing(scenario, policy=_POLICY, perception="truth", seed=seed)

    return AttentionCheck.of(template, results())


def _names(scenario: Scenario, measured: Sequence[MeasuredAttention]) -> list[str]:
    """Return the names of all people: scripted workers, people, replayed people."""
    names = [f"worker {number}" for number in range(len(scenario.workers))]
    names += [person.name for person in scenario.people]
    everybody = max((len(each.could_look_s) for each in measured), default=0)
    return names + [f"recorded person {number}" for number in range(everybody - len(names))]


def _people(
    names: Sequence[str], measured: Sequence[MeasuredAttention]
) -> Iterator[PersonAttention]:
    for index, name in enumerate(names):
        sums = np.zeros(3)
        for each in measured:
            if each.judged[index]:
                times = (each.could_look_s, each.aware_s, each.looked_s)
                sums += [float(time[index]) for time in times]
        could_look_s, aware_s, looked_s = sums.tolist()
        if could_look_s > 0.0:
            yield PersonAttention(
                name, could_look_s, aware_s / could_look_s, looked_s / could_look_s
            )
