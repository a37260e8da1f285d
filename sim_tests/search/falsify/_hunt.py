"""How near an episode came to harm, as the number that is made small.

The search in one scenario: CMA-ES, begun anew where it finds no more.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ...study.measures import EpisodeRecord
from .._optuna import optuna
from .._search import Outcome, Parameters, Range, Search
from .._trials import NOTES, TrialBook

#: A contact that the robot caused lies so far below every margin.
CONTACT: Final = -10.0
#: The robot never moved near anybody, or the episode has no result.
NOTHING: Final = 10.0


def score(record: EpisodeRecord) -> float:
    """The smallest separation margin at a moving robot, in metres, within (−10, 10].

    A contact caused by the robot gives −10 less the robot's speed in m/s, so that harder ones are
    worse. An episode without a result gives 10: it shows nothing.
    """
    if record.error:
        return NOTHING
    if record.robot_contacts > 0:
        return CONTACT - (record.contact_speed_mps or 0.0)
    if record.min_margin_m is None:
        return NOTHING
    return min(max(record.min_margin_m, CONTACT + 0.001), NOTHING)


# A round ends after so many generations whose last few brought less than this.
_LEAST_GENERATIONS: Final = 8
_PATIENCE: Final = 4
_PROGRESS_M: Final = 0.02
# First standard deviation of CMA-ES as a share of each range: where the scenario is as written it
# explores, elsewhere it covers.
_FIRST_SPREAD: Final = 0.25
_LATER_SPREAD: Final = 0.3


@dataclass(frozen=True, slots=True)
class Find:
    """One episode of a hunt.

    Attributes:
        scenario: name of the template.
        round: of the search.
        trial: number in the round.
        parameters: the levers.
        score: see :func:`~sim_tests.falsify._score.score`.
        notes: further figures of the episode.
    """

    scenario: str
    round: int
    trial: int
    parameters: Parameters
    score: float
    notes: dict[str, object]


Evaluate = Callable[[Sequence[Parameters]], Sequence[Outcome]]


class Hunt:
    """Looks for the smallest score in one space.

    Args:
        name: of the scenario.
        ranges: where to search, by lever.
        neutral: where the scenario is as it was written; the first round starts there, later ones
            at places drawn from the seed.
        evaluate: what levers come to, several at a time.
        folder: of the studies.
        seed: of the search.
        generation: episodes a generation.
    """

    def __init__(
        self,
        name: str,
        ranges: dict[str, Range],
        neutral: Parameters,
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

    def run(self, total: int) -> list[Find]:
        """Go on until so many episodes have run in all; everything found so far, in order.

        Args:
            total: a multiple of the generation.
        """
        found: list[Find] = []
        number = 0
        while len(found) < total:
            found += self._round(number, total - len(found))
            number += 1
        return found

    def _round(self, number: int, most: int) -> list[Find]:
        key = [self._seed, zlib.crc32(self.name.encode()), number]
        rng = np.random.default_rng(key)
        start = dict(self._neutral)
        if number > 0:
            shares = rng.random(len(self._ranges)).tolist()
            start = {
                name: (1.0 - share) * each.low + share * each.high
                for share, (name, each) in zip(shares, self._ranges.items(), strict=True)
            }
        search = Search(
            "cmaes",
            self._ranges,
            generation=self._generation,
            seed=int(rng.integers(2**31)),
            first=[start],
            start=start,
            spread=_FIRST_SPREAD if number == 0 else _LATER_SPREAD,
        )
        with TrialBook(self._folder, f"{self.name}-{number:02d}", search, most) as book:
            while True:
                trials = book.finished_trials()
                if len(trials) >= most or _is_exhausted(trials, self._generation):
                    return [self._find(number, trial) for trial in trials]
                tickets = book.claim(self._generation)
                outcomes = self._evaluate([ticket.parameters for ticket in tickets])
                for ticket, outcome in zip(tickets, outcomes, strict=True):
                    book.tell(ticket, outcome)

    def _find(self, number: int, trial: optuna.trial.FrozenTrial) -> Find:
        return Find(
            self.name,
            number,
            trial.number,
            dict(trial.params),
            trial.values[0],
            trial.user_attrs.get(NOTES, {}),
        )


def _is_exhausted(trials: Sequence[optuna.trial.FrozenTrial], generation: int) -> bool:
    """Whether the last whole generations of a round brought next to nothing."""
    whole = len(trials) // generation
    if len(trials) % generation or whole < _LEAST_GENERATIONS:
        return False
    best = np.array([trial.values[0] for trial in trials]).reshape(whole, generation).min(axis=1)
    return bool(best[-_PATIENCE:].min() > best[:-_PATIENCE].min() - _PROGRESS_M)
