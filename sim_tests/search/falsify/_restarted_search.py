"""The search for the smallest score in one scenario: CMA-ES with restarts."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...study.measures import EpisodeRecord
from .._optimizer import Optimizer, Outcome, ParameterValues, Range
from .._optuna import optuna
from .._shared_study import NOTES, Claim, SharedStudy

#: Score of a contact with the moving robot that counts, below every margin.
CONTACT_SCORE: Final = -10.0
#: Score without a margin: the robot never moved near a person, or the episode has no result.
NO_MARGIN_SCORE: Final = 10.0

# A round ends after at least this many generations, when the last few improve by less than this.
_LEAST_GENERATIONS: Final = 8
_LAST_GENERATIONS: Final = 4
_LEAST_PROGRESS_M: Final = 0.02
# Initial standard deviation of CMA-ES as a share of each range: the first round explores around the
# scenario as written, later rounds cover the space.
_FIRST_SPREAD: Final = 0.25
_LATER_SPREAD: Final = 0.3

#: Evaluates several points of the space.
Evaluate = Callable[[Sequence[ParameterValues]], Sequence[Outcome]]


def score(record: EpisodeRecord, *, everybody: bool = False) -> float:
    """Return the score of an episode: the smallest separation margin at a moving robot, in metres.

    The margin is that to people who have not looked at the robot for 1 s, or never. It lies within
    (−10, 10]. A contact of the moving robot with them gives −10 less the robot's speed in m/s, so
    that a faster contact scores lower. Who walks into whom does not matter. An episode without a
    result gives 10.

    Args:
        record: the episode.
        everybody: people who have looked count, too.
    """
    if record.error:
        return NO_MARGIN_SCORE
    if record.moving_contacts_unaware > 0:
        return CONTACT_SCORE - (record.moving_contact_unaware_mps or 0.0)
    if everybody and record.moving_contacts > 0:
        return CONTACT_SCORE - (record.moving_contact_mps or 0.0)
    margin_m = record.min_margin_m if everybody else record.min_margin_unaware_m
    if margin_m is None:
        return NO_MARGIN_SCORE
    return min(max(margin_m, CONTACT_SCORE + 0.001), NO_MARGIN_SCORE)


@dataclass(frozen=True, slots=True)
class EvaluatedTrial:
    """One episode of a search.

    Attributes:
        scenario: name of the template.
        round: number of the round; every restart begins one.
        trial: number of the trial in its round.
        parameters: values of the parameters.
        score: see :func:`score`.
        notes: other figures of the episode.
    """

    scenario: str
    round: int
    trial: int
    parameters: ParameterValues
    score: float
    notes: dict[str, Any]


class RestartedSearch:
    """A search for the smallest score in one space, by CMA-ES with restarts.

    A round that makes no more progress ends, and the next one restarts elsewhere.

    Args:
        name: name of the scenario.
        ranges: ranges of the parameters.
        neutral: values of the scenario as written, where the first round starts; later rounds start
            at points drawn from the seed.
        evaluate: evaluates points of the space.
        folder: folder of the studies.
        seed: seed of the search.
        generation: episodes per generation.
    """

    def __init__(
        self,
        name: str,
        ranges: dict[str, Range],
        neutral: ParameterValues,
        evaluate: Evaluate,
        folder: Path,
        *,
        seed: int,
        generation: int,
    ) -> None:
        self.name = name
        self._ranges = ranges
        self._neutral = neutral
        self._evaluate = evaluate
        self._folder = folder
        self._seed = seed
        self._generation = generation

    def run(self, total: int) -> list[EvaluatedTrial]:
        """Continue the search up to a total number of episodes.

        Args:
            total: a multiple of the generation.

        Returns:
            All trials so far, in the order in which they were proposed.
        """
        trials: list[EvaluatedTrial] = []
        number = 0
        while len(trials) < total:
            trials += self._run_round(number, total - len(trials))
            number += 1
        return trials

    def _run_round(self, number: int, most: int) -> list[EvaluatedTrial]:
        """Run one round, to its end or up to a number of trials; return its trials."""
        key = [self._seed, zlib.crc32(self.name.encode()), number]
        rng = np.random.default_rng(key)
        start = dict(self._neutral)
        if number > 0:
            shares = rng.random(len(self._ranges)).tolist()
            start = {
                name: (1.0 - share) * each.low + share * each.high
                for share, (name, each) in zip(shares, self._ranges.items(), strict=True)
            }
        optimizer = Optimizer(
            "cmaes",
            self._ranges,
            generation=self._generation,
            seed=int(rng.integers(2**31)),
            initial=[start],
            start=start,
            spread=_FIRST_SPREAD if number == 0 else _LATER_SPREAD,
        )

        def outcomes_of(claims: Sequence[Claim]) -> Sequence[Outcome]:
            return self._evaluate([claim.parameters for claim in claims])

        with SharedStudy(self._folder, f"{self.name}-{number:02d}", optimizer, most) as study:
            while True:
                trials = study.finished_trials()
                if len(trials) >= most or _has_converged(trials, self._generation):
                    return [self._evaluated(number, trial) for trial in trials]
                study.evaluate(self._generation, outcomes_of)

    def _evaluated(self, number: int, trial: optuna.trial.FrozenTrial) -> EvaluatedTrial:
        return EvaluatedTrial(
            self.name,
            number,
            trial.number,
            dict(trial.params),
            trial.values[0],
            trial.user_attrs.get(NOTES, {}),
        )


def _has_converged(trials: Sequence[optuna.trial.FrozenTrial], generation: int) -> bool:
    """Return whether the last generations of a round brought almost no progress."""
    whole = len(trials) // generation
    if len(trials) % generation or whole < _LEAST_GENERATIONS:
        return False
    best = np.array([trial.values[0] for trial in trials]).reshape(whole, generation).min(axis=1)
    return bool(
        best[-_LAST_GENERATIONS:].min() > best[:-_LAST_GENERATIONS].min() - _LEAST_PROGRESS_M
    )
