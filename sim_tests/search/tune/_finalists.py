"""The finalists of a tuning: the best trials, compared with the base policy on held-out."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from nav_adapter import AwarenessPolicy

from ...study.measures import FEW_PAIRS
from ._evaluation import OBJECTIVE, Evaluation

#: The name of a finalist that is shown to be better than the base policy.
BEATS_BASE: Final = "beats_base"
#: The names of the trials with the least time lost within the bounds.
PLACES: Final = ("least_time_lost", "second", "third")
#: All names of finalists.
REASONS: Final = (BEATS_BASE, *PLACES)
_LEVEL: Final = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A policy with its evaluation on both sets of seeds.

    Attributes:
        names: presets and the base policy by name, trials by their place. A policy may have several
            names.
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
    candidate: Candidate,
    base: Candidate,
    risk: float,
    hold_out_scenarios: Container[str],
    level: float,
    requests: float | None = None,
) -> bool:
    """Return whether the held-out episodes show that a policy is better than the base policy.

    They show it if its step-out impacts are within the given risk and its requests for attention
    per crossing within their bound, if there is one, the moving robot touched nobody, and over at
    least :data:`FEW_PAIRS` pairs the paired interval of the time lost lies below 0, without a worse
    mean in the held-out scenarios alone. The time does not matter if the base policy is above the
    risk or the bound.
    """
    held_out = candidate.held_out
    if held_out.moving_contacts or candidate.tuning.moving_contacts:
        return False
    if not held_out.is_within(risk, requests):
        return False
    whole = held_out.minus(base.held_out, OBJECTIVE, level)
    if whole.n < FEW_PAIRS:
        return False
    if not base.held_out.is_within(risk, requests):
        return True
    part = held_out.within(hold_out_scenarios).minus(base.held_out, OBJECTIVE, level)
    return whole.high < 0.0 and not (part.n and part.value > 0.0)


def named_winner(
    candidates: Sequence[Candidate],
    base: Candidate,
    risk: float,
    hold_out_scenarios: Container[str],
    requests: float | None = None,
) -> list[Candidate]:
    """Return the candidates; the best of those that beat the base policy has that name first."""
    level = level_of(len(candidates))
    winners = [
        each for each in candidates if beats(each, base, risk, hold_out_scenarios, level, requests)
    ]
    if not winners:
        return list(candidates)
    best = min(winners, key=lambda each: each.held_out.figures)
    return [
        replace(each, names=(BEATS_BASE, *each.names)) if each is best else each
        for each in candidates
    ]
