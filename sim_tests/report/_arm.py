"""The things compared: a policy, with the planner and the perception that it ran with."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from ._episode import Episode

Role = Literal["reference", "candidate", "ceiling"]

#: The policy that awareness is compared with, and the one that knows the truth.
REFERENCE: Final = "blind"
CEILING: Final = "oracle"
# Looks of marks: see the shapes of the template and the colours of its style sheet.
_LOOKS: Final = 6
_REFERENCE_LOOK: Final = 0
_CEILING_LOOK: Final = 2


@dataclass(frozen=True, slots=True)
class Arm:
    """One thing compared.

    Attributes:
        name: as the page shows it; unique.
        policy: name of the policy.
        planner: name of the planner.
        perception: what the robot saw with.
        role: ``"reference"`` ignores awareness, ``"ceiling"`` knows the truth, the others are to
            be judged.
        look: number of its colour and shape.
        episodes: without a fault, those that failed left out.
        faulted: under faults, those that failed left out.
        errors: episodes that ended in an error.
    """

    name: str
    policy: str
    planner: str
    perception: str
    role: Role
    look: int
    episodes: tuple[Episode, ...]
    faulted: tuple[Episode, ...]
    errors: tuple[Episode, ...]


def arms_of(episodes: Iterable[Episode]) -> tuple[Arm, ...]:
    """Sort episodes by what they are to be compared for: reference, candidates, ceiling."""
    groups: dict[tuple[str, str, str], list[Episode]] = {}
    for episode in episodes:
        record = episode.record
        groups.setdefault((record.policy, record.planner, record.perception), []).append(episode)
    keys = sorted(groups, key=lambda key: {"candidate": 1, "ceiling": 2}.get(_role(key), 0))
    free = [look for look in range(_LOOKS) if look not in (_REFERENCE_LOOK, _CEILING_LOOK)]
    arms = []
    candidates = 0
    for key in keys:
        role = _role(key)
        look = {"reference": _REFERENCE_LOOK, "ceiling": _CEILING_LOOK}.get(role)
        if look is None:
            look = free[candidates % len(free)]
            candidates += 1
        good = [episode for episode in groups[key] if not episode.record.error]
        arms.append(
            Arm(
                _name(key, keys),
                *key,
                role,
                look,
                tuple(each for each in good if not each.record.fault),
                tuple(each for each in good if each.record.fault),
                tuple(each for each in groups[key] if each.record.error),
            )
        )
    return tuple(arms)


def judged(arms: Sequence[Arm]) -> tuple[Arm, ...]:
    """The arms that a verdict is about: the candidates, or all where there are none."""
    return tuple(arm for arm in arms if arm.role == "candidate") or tuple(arms)


def _role(key: tuple[str, str, str]) -> Role:
    if key[0] == REFERENCE:
        return "reference"
    return "ceiling" if key[0] == CEILING else "candidate"


def _name(key: tuple[str, str, str], keys: Sequence[tuple[str, str, str]]) -> str:
    """The policy's name, and of planner and perception what it takes to tell arms apart."""
    same = [other for other in keys if other[0] == key[0]]
    parts = [key[0]]
    parts += [key[place] for place in (1, 2) if len({other[place] for other in same}) > 1]
    return " · ".join(parts)
