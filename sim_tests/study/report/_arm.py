"""The arms of a comparison: a policy with the planner and perception that it ran with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from ..measures import BASELINE, EpisodeRecord, Variant, labels

Role = Literal["reference", "candidate", "ceiling"]

#: The policy that knows the truth.
CEILING: Final = "oracle"
# Looks of marks: the shapes of the template and the colours of its style sheet.
_LOOKS: Final = 6
_REFERENCE_LOOK: Final = 0
_CEILING_LOOK: Final = 2


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode of a run.

    Attributes:
        number: number of its job, from 0, as ``awarenav replay`` takes it; None without a job.
        record: its row in ``episodes.csv``.
    """

    number: int | None
    record: EpisodeRecord

    @property
    def pair(self) -> tuple[str, int, int]:
        """Scenario, version and seed, which paired episodes of different policies share."""
        return self.record.scenario, self.record.scenario_version, self.record.seed


@dataclass(frozen=True, slots=True)
class Arm:
    """One arm of the comparison, in the sense of a clinical trial.

    Attributes:
        name: unique name in tables.
        policy: name of the policy.
        planner: name of the planner.
        perception: name of the perception.
        role: ``"reference"`` ignores awareness, ``"ceiling"`` knows the truth, and a verdict is
            about each ``"candidate"``.
        look: number of its colour and shape.
        episodes: episodes without an error, under the fault of the report.
        others: episodes without an error, under other faults.
        errors: episodes that ended in an error.
    """

    name: str
    policy: str
    planner: str
    perception: str
    role: Role
    look: int
    episodes: tuple[Episode, ...]
    others: tuple[Episode, ...]
    errors: tuple[Episode, ...]


def arms_of(episodes: Sequence[Episode], fault: str) -> tuple[Arm, ...]:
    """Return the arms of a run: reference, candidates, ceiling.

    Args:
        episodes: all episodes of the run.
        fault: fault of the report, empty for none.
    """
    groups: dict[Variant, list[Episode]] = {}
    for episode in episodes:
        record = episode.record
        variant = Variant(record.policy, record.planner, record.perception)
        groups.setdefault(variant, []).append(episode)
    names = labels(groups)
    order = sorted(
        groups, key=lambda each: ("reference", "candidate", "ceiling").index(_role(each))
    )
    free = [look for look in range(_LOOKS) if look not in (_REFERENCE_LOOK, _CEILING_LOOK)]
    arms: list[Arm] = []
    for variant in order:
        role = _role(variant)
        look = {"reference": _REFERENCE_LOOK, "ceiling": _CEILING_LOOK}.get(role)
        if look is None:
            look = free[sum(arm.role == "candidate" for arm in arms) % len(free)]
        completed = [episode for episode in groups[variant] if not episode.record.error]
        arms.append(
            Arm(
                names[variant],
                variant.policy,
                variant.planner,
                variant.perception,
                role,
                look,
                tuple(each for each in completed if each.record.fault == fault),
                tuple(each for each in completed if each.record.fault != fault),
                tuple(each for each in groups[variant] if each.record.error),
            )
        )
    return tuple(arms)


def judged_arms(arms: Sequence[Arm]) -> tuple[Arm, ...]:
    """Return the arms that verdicts are about: the candidates, or all arms without candidates."""
    return tuple(arm for arm in arms if arm.role == "candidate") or tuple(arms)


def _role(variant: Variant) -> Role:
    if variant.policy == BASELINE:
        return "reference"
    return "ceiling" if variant.policy == CEILING else "candidate"
