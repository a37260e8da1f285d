"""Policies over many episodes: time lost, risk, when a trial ends, who beats the base policy."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from nav_adapter import AwarenessPolicy

from ...study.measures import (
    FEW_PAIRS,
    EpisodeRecord,
    Interval,
    bootstrap_interval,
    paired_difference,
)

#: What is minimised: a field of :class:`EpisodeRecord`.
OBJECTIVE: Final = "time_lost_s"
#: What is bounded, the same.
RISK: Final = "step_out_not_looking"
#: The risk in words.
RISK_WORDS: Final = "step-out impacts with people who do not look, per 1 000 crossings"
#: The figures of a policy, in the order of tables.
FIGURES: Final = (OBJECTIVE, RISK)
#: Why a trial ended before all of its episodes; empty if it did not.
Dropped = Literal["", "contact", "risk", "loses"]

#: The name of a finalist that is shown to be better than the base policy.
BEATS_BASE: Final = "beats_base"
#: The names of the trials with the least time lost within the bounds.
PLACES: Final = ("least_time_lost", "second", "third")
#: All names of finalists.
REASONS: Final = (BEATS_BASE, *PLACES)
_LEVEL: Final = 0.95
# With fewer pairs of episodes, the bootstrap interval is too narrow to end a trial.
_LEAST_PAIRS: Final = 12


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """The evaluation of a policy over many episodes.

    Attributes:
        records: records of the episodes with a result, sorted by scenario and seed.
        errors: errors of the others.
    """

    records: tuple[EpisodeRecord, ...]
    errors: tuple[str, ...] = ()

    @classmethod
    def of(cls, records: Sequence[EpisodeRecord]) -> Evaluation:
        """Return the evaluation of episodes."""
        completed = [record for record in records if not record.error]
        completed.sort(key=lambda record: (record.scenario, record.seed))
        return cls(tuple(completed), tuple(record.error for record in records if record.error))

    @classmethod
    def joined(cls, parts: Iterable[Evaluation]) -> Evaluation:
        """Return the evaluation of the episodes of several parts."""
        rows = list(parts)
        whole = cls.of([record for each in rows for record in each.records])
        return replace(whole, errors=tuple(error for each in rows for error in each.errors))

    def within(self, scenarios: Container[str]) -> Evaluation:
        """Return the episodes in some of the scenarios, by name."""
        return replace(self, records=tuple(r for r in self.records if r.scenario in scenarios))

    def same_episodes(self, other: Evaluation) -> Evaluation:
        """Return the episodes of which the other evaluation has the scenario and the seed too."""
        tasks = {(each.scenario, each.seed) for each in other.records}
        kept = tuple(each for each in self.records if (each.scenario, each.seed) in tasks)
        return replace(self, records=kept)

    def equals(self, other: Evaluation) -> bool:
        """Return whether every episode has the same metrics as the other policy's."""
        mine, others = (
            [replace(record, policy="") for record in each.records] for each in (self, other)
        )
        return mine == others

    def estimate(self, base: Evaluation) -> tuple[float, float]:
        """Return the figures over all episodes of the base policy, from fewer episodes.

        They are the base policy's means over all of its episodes, plus the mean paired differences
        (a control variate). With all episodes they are :attr:`figures`.
        """
        part = base.same_episodes(self).figures
        time_s, risk = (
            mine + (whole - same)
            for mine, whole, same in zip(self.figures, base.figures, part, strict=True)
        )
        return time_s, risk

    @property
    def figures(self) -> tuple[float, float]:
        """Mean time lost, seconds, and mean step-out impacts per 1 000 crossings."""
        time_s, risk = (float(np.mean(self._values(name))) for name in FIGURES)
        return time_s, risk

    @property
    def risk(self) -> float:
        """Mean step-out impacts with people who do not look, per 1 000 crossings."""
        return self.figures[1]

    @property
    def requests(self) -> float:
        """Mean requests for attention per crossing."""
        return float(np.mean(self._values("requests"))) if self.records else 0.0

    def is_within(self, risk: float, requests: float | None) -> bool:
        """Return whether step-out impacts and requests per crossing are at most the given ones."""
        return self.risk <= risk and (requests is None or self.requests <= requests)

    @property
    def moving_contacts(self) -> int:
        """Number of episodes in which a moving robot and a person touched, by any cause."""
        return sum(record.moving_touched for record in self.records)

    @property
    def reached(self) -> int:
        """Number of episodes that reached the goal."""
        return sum(record.time_to_goal_s is not None for record in self.records)

    def interval(self, figure: str) -> Interval:
        """Return the mean of a figure with its 95 % interval, resampled within scenarios."""
        return bootstrap_interval(
            self._values(figure),
            np.random.default_rng(0),
            strata=[record.scenario for record in self.records],
        )

    def minus(self, base: Evaluation, figure: str, level: float = 0.95) -> Interval:
        """Return the mean difference to another policy on the same episodes, with its interval."""
        return paired_difference(base.records, self.records, figure, level=level)

    def _values(self, name: str) -> list[float]:
        values = [getattr(record, name) for record in self.records]
        return [0.0 if value is None else float(value) for value in values]


def stages(seeds: range) -> Iterator[range]:
    """Yield consecutive parts of the seeds, after which 1, 2, 4, 8, … and all of them have run."""
    done = 0
    while done < len(seeds):
        step = min(max(done, 1), len(seeds) - done)
        yield seeds[done : done + step]
        done += step


def dropped(candidate: Evaluation, base: Evaluation, risk: float) -> Dropped:
    """Return why a trial need not run more episodes, or an empty text.

    A contact of a moving robot ends it. So does a 95 % interval of the step-out impacts above the
    given risk, and a paired one that shows that it loses more time than a base policy within that
    risk.
    """
    if candidate.moving_contacts:
        return "contact"
    slower = candidate.minus(base, OBJECTIVE)
    if slower.n < _LEAST_PAIRS:
        return ""
    if candidate.interval(RISK).low > risk:
        return "risk"
    return "loses" if slower.low > 0.0 and base.risk <= risk else ""


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
