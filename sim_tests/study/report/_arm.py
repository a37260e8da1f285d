"""An episode as the report knows it: its row and its number.

The things compared: a policy, with the planner and the perception that it ran with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from ..measures import BASELINE, EpisodeRecord, Variant, labels


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode of a run.

    Attributes:
        number: counts jobs from 0; what ``awarenav replay`` asks for. None where no job is known.
        record: its row.
    """

    number: int | None
    record: EpisodeRecord

    @property
    def pair(self) -> tuple[str, int, int]:
        """Scenario, version and seed: what episodes of different policies have in common."""
        return self.record.scenario, self.record.scenario_version, self.record.seed


Role = Literal["reference", "candidate", "ceiling"]

#: The policy that knows the truth.
CEILING: Final = "oracle"
# Looks of marks: see the shapes of the template and the colours of its style sheet.
_LOOKS: Final = 6
_REFERENCE_LOOK: Final = 0
_CEILING_LOOK: Final = 2


@dataclass(frozen=True, slots=True)
class Arm:
    """One thing compared.

    Attributes:
        name: as tables call it; unique.
        policy: name of the policy.
        planner: name of the planner.
        perception: what the robot saw with.
        role: ``"reference"`` ignores awareness, ``"ceiling"`` knows the truth, the others are to
            be judged.
        look: number of its colour and shape.
        episodes: under the fault (or none) that most of the page is about; no errors among them.
        others: under other faults; no errors among them.
        errors: those that broke off.
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
    """Sort episodes by what they are to be compared for: reference, candidates, ceiling.

    Args:
        episodes: all of a run.
        fault: that most of the page is about, empty for none.
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
        good = [episode for episode in groups[variant] if not episode.record.error]
        arms.append(
            Arm(
                names[variant],
                variant.policy,
                variant.planner,
                variant.perception,
                role,
                look,
                tuple(each for each in good if each.record.fault == fault),
                tuple(each for each in good if each.record.fault != fault),
                tuple(each for each in groups[variant] if each.record.error),
            )
        )
    return tuple(arms)


def judged(arms: Sequence[Arm]) -> tuple[Arm, ...]:
    """The arms that a verdict is about: the candidates, or all where there are none."""
    return tuple(arm for arm in arms if arm.role == "candidate") or tuple(arms)


def _role(variant: Variant) -> Role:
    if variant.policy == BASELINE:
        return "reference"
    return "ceiling" if variant.policy == CEILING else "candidate"
