"""The finalists of a tuning: trials of the front, compared with the base policy on held-out."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from nav_adapter import AwarenessPolicy

from ...study.measures import FEW_PAIRS
from .._optuna import optuna
from ._evaluation import OBJECTIVES, Evaluation, knee

#: The name of a finalist that is shown to be better than the base policy.
BEATS_BASE: Final = "beats_base"
#: The name of a trial that is no worse than the base policy in either objective on tuning seeds.
NO_WORSE: Final = "no_worse_in_tuning"
#: All names of finalists.
REASONS: Final = (BEATS_BASE, "least_time_lost", "knee", "least_violation", NO_WORSE)
_LEVEL: Final = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A policy with its evaluation on both sets of seeds.

    Attributes:
        names: presets and the base policy by name, trials by the reasons why they were chosen. A
            policy may have several names.
        trial: number of the trial; None for presets and the base policy.
        policy: the policy.
        tuning: evaluation on the tuning seeds in the tuning scenarios.
        held_out: evaluation on the held-out seeds in all scenarios.
    """

    names: tuple[str, ...]
    trial: int | None
    policy: AwarenessPolicy
    tuning: Evaluation
    held_out: Evaluation

    @property
    def name(self) -> str:
        """The first name."""
        return self.names[0]

    def equals(self, other: Candidate) -> bool:
        """Return whether the policies are the same, or nothing in any episode tells them apart."""
        return self.policy == other.policy or (
            self.tuning.equals(other.tuning) and self.held_out.equals(other.held_out)
        )


def chosen_trials(
    front: Sequence[optuna.trial.FrozenTrial], base: Evaluation
) -> dict[int, tuple[str, ...]]:
    """Return the reasons for which trials of the front are chosen, by row of the front.

    Args:
        front: trials of the front, by time lost.
        base: the base policy on the tuning seeds.
    """
    if not front:
        return {}
    points = [(trial.values[0], trial.values[1]) for trial in front]
    rows = {"least_time_lost": 0, "knee": knee(points), "least_violation": len(points) - 1}
    time_s, violation_s = base.objectives
    better = [
        row
        for row, point in enumerate(points)
        if point[0] <= time_s and point[1] <= violation_s and point != (time_s, violation_s)
    ]
    if better:
        rows[NO_WORSE] = better[knee([points[row] for row in better])]
    reasons: dict[int, tuple[str, ...]] = {}
    for name, row in rows.items():
        reasons[row] = (*reasons.get(row, ()), name)
    return reasons


def merged(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return the candidates with equal ones as one, which has all of their names."""
    rows: list[Candidate] = []
    for each in candidates:
        same = next((row for row, other in enumerate(rows) if other.equals(each)), None)
        if same is None:
            rows.append(each)
        else:
            names = (*rows[same].names, *each.names)
            rows[same] = replace(rows[same], names=tuple(dict.fromkeys(names)))
    return rows


def level_of(finalists: int) -> float:
    """Return the confidence of each comparison, so that all of them hold with 95 % (Bonferroni)."""
    return 1.0 - (1.0 - _LEVEL) / max(finalists, 1)


def beats(
    candidate: Candidate, base: Candidate, hold_out_scenarios: Container[str], level: float
) -> bool:
    """Return whether the held-out episodes show that a policy is better than the base policy.

    They show it if the paired interval of one objective lies below 0 and that of the other does not
    lie above 0, over at least :data:`FEW_PAIRS` pairs; if neither mean is worse for that objective
    in the held-out scenarios alone, nor either interval above 0 there; and if the robot moved into
    nobody.
    """
    if candidate.held_out.robot_contacts or candidate.tuning.robot_contacts:
        return False
    found = [candidate.held_out.minus(base.held_out, each, level) for each in OBJECTIVES]
    if min(each.n for each in found) < FEW_PAIRS or any(each.low > 0.0 for each in found):
        return False
    elsewhere = [
        candidate.held_out.within(hold_out_scenarios).minus(base.held_out, each, level)
        for each in OBJECTIVES
    ]
    if any(each.n and each.low > 0.0 for each in elsewhere):
        return False
    return any(
        whole.high < 0.0 and not (part.n and part.value > 0.0)
        for whole, part in zip(found, elsewhere, strict=True)
    )


def named_winner(
    candidates: Sequence[Candidate], base: Candidate, hold_out_scenarios: Container[str]
) -> list[Candidate]:
    """Return the candidates; the best of those that beat the base policy has that name first."""
    level = level_of(len(candidates))
    winners = [each for each in candidates if beats(each, base, hold_out_scenarios, level)]
    if not winners:
        return list(candidates)
    best = min(winners, key=lambda each: each.held_out.objectives)
    return [
        replace(each, names=(BEATS_BASE, *each.names)) if each is best else each
        for each in candidates
    ]
