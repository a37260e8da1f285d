"""A falsification: the search over several scenarios for the smallest separation margins.

In one scenario the search is CMA-ES with restarts: a round that makes no more progress ends, and
the next one starts elsewhere.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, Final

import numpy as np

from perception.documents import yaml_text

from ...crossing.planner import refuse_unusable_planner
from ...scenario import Scenario
from ...study.measures import FAST_IMPACT_MPS, NOTICED, EpisodeRecord
from ...study.runs import Job, job_of, policy_of, terminated_as_interrupted
from ...world.errors import SimError
from .._settings import EpisodeRunner, SearchSettings, search_folder
from .._study import Evaluate, Optimizer, Outcome, ParameterValues, Range, Trial
from ._no_floor_planner import LABEL, PLANNER
from ._scenario_space import ScenarioSpace

#: Score of a contact with the moving robot that counts, below every margin.
CONTACT_SCORE: Final = -10.0
#: Score without a margin: the robot never moved near a person, or the episode has no result.
NO_MARGIN_SCORE: Final = 10.0

_SETTINGS_FILE: Final = "falsify.json"
_RESULTS: Final = ("worst_*.yaml", "policy.yaml", "episodes.csv", "summary.json", "falsify.png")
# Share of the episodes that go to all scenarios alike; the rest go to the worst of them.
_FIRST_SHARE: Final = 0.5
# One scenario in so many is among the worst.
_WORST_ONE_IN: Final = 3
# A round ends after at least this many generations, when the last few improve by less than this.
_LEAST_GENERATIONS: Final = 8
_LAST_GENERATIONS: Final = 4
_LEAST_PROGRESS_M: Final = 0.02
# Initial standard deviation of CMA-ES as a share of each range: the first round explores around the
# scenario as written, later rounds cover the space.
_FIRST_SPREAD: Final = 0.25
_LATER_SPREAD: Final = 0.3
# Figures of an episode that its trial keeps.
_NOTES: Final = (
    *("min_margin_never_m", "min_separation_m", "contact_by", "moving_contacts"),
    *(f"moving_contacts_{noticed}" for noticed in NOTICED),
    *(f"moving_contact_{noticed}_mps" for noticed in NOTICED),
    *("moving_contacts_asked", "moving_contact_asked_mps", "moving_contact_stoppable_mps"),
    *("moving_contact_mps", "speed_at_min_separation_mps"),
    *("awareness", "reaction", "error"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FalsifySettings(SearchSettings):
    """The settings of a falsification; ``episodes`` is the least number of all together.

    Attributes:
        people: number of people of a scenario that are varied.
        unsafe_no_floor: run the planner without the adapter's floor, on purpose.
    """

    people: int
    unsafe_no_floor: bool = False

    @property
    def planner_of_jobs(self) -> str:
        """The planner, or the one without the floor."""
        return PLANNER if self.unsafe_no_floor else self.planner

    def job(self, scenario: Scenario) -> Job:
        """Return the job of a variation."""
        name = self.policy_name + (f" {LABEL}" if self.unsafe_no_floor else "")
        return job_of(
            yaml_text(scenario.model_dump(mode="json")),
            (name, self.policy),
            self.planner_of_jobs,
            seed=self.seed,
            perception=self.perception,
        )


@dataclass(frozen=True, slots=True)
class SearchedEpisode:
    """One episode of a search.

    Attributes:
        scenario: its name.
        round: number of the round; every restart begins one.
        trial: the trial of that round; its value is the :func:`score`.
    """

    scenario: str
    round: int
    trial: Trial

    @property
    def score(self) -> float:
        """See :func:`score`."""
        return self.trial.outcome.value or 0.0

    @property
    def notes(self) -> Mapping[str, Any]:
        """Other figures of the episode."""
        return self.trial.outcome.notes

    @property
    def touches(self) -> bool:
        """True for a contact that counts, see :func:`score`."""
        return self.score <= CONTACT_SCORE

    @property
    def inevitable(self) -> bool:
        """True for contacts before which no robot could have stopped that did more than creep."""
        found = self.notes.get("moving_contact_stoppable_mps")
        return self.touches and found is not None and found < FAST_IMPACT_MPS


@dataclass(frozen=True, slots=True)
class Falsification:
    """The result of a falsification.

    Attributes:
        settings: its settings.
        spaces: search spaces by scenario.
        episodes: every episode, by scenario, in the order in which they were proposed.
        interrupted: the search ended before all episodes had run.
    """

    settings: FalsifySettings
    spaces: dict[str, ScenarioSpace]
    episodes: tuple[SearchedEpisode, ...]
    interrupted: bool = False

    @property
    def contacts(self) -> int:
        """Number of episodes in which the moving robot touched a person who counts.

        They are people who have never noticed it, or only when it asked them to. Without the floor,
        everybody counts.
        """
        return sum(each.touches for each in self.episodes)

    @property
    def inevitable(self) -> int:
        """Number of these that are inevitable."""
        return sum(each.inevitable for each in self.episodes)

    @property
    def contact_mps(self) -> float:
        """The robot's highest speed at one of these contacts; 0 without any."""
        return max(CONTACT_SCORE - min((each.score for each in self.episodes), default=0.0), 0.0)

    @property
    def other_speeds_mps(self) -> dict[str, list[float]]:
        """The robot's speeds at contacts with people who had noticed it, by when they last looked.

        Each is that of the fastest contact of an episode in which the robot moved.
        """
        speeds_mps = {
            noticed: [each.notes.get(f"moving_contact_{noticed}_mps") for each in self.episodes]
            for noticed in NOTICED
            if noticed != "never"
        }
        return {
            noticed: [float(each) for each in found if each is not None]
            for noticed, found in speeds_mps.items()
        }

    @property
    def errors(self) -> int:
        """Number of episodes without a result."""
        return sum(bool(each.notes.get("error")) for each in self.episodes)


@dataclass(frozen=True, slots=True)
class Budget:
    """The episodes of a falsification, in whole generations.

    ``total_if_worst`` is that of each of the ``worst`` scenarios, its ``first`` ones included.
    """

    first: int
    total_if_worst: int
    worst: int

    @classmethod
    def of(cls, episodes: int, scenarios: int, generation: int) -> Budget:
        """Return a budget of at least a number of episodes.

        Raises:
            SimError: fewer episodes than one generation per scenario.
        """
        if episodes < generation * scenarios:
            raise SimError(
                f"--episodes must be at least one generation of {generation} per scenario, "
                f"{generation * scenarios} for {scenarios}, got {episodes}"
            )
        if scenarios == 1:
            all_episodes = math.ceil(episodes / generation) * generation
            return cls(all_episodes, all_episodes, 0)
        worst = max(scenarios // _WORST_ONE_IN, 1)
        first = max(int(_FIRST_SHARE * episodes / scenarios) // generation, 1) * generation
        rest = max(episodes - first * scenarios, 0)
        more = math.ceil(rest / (worst * generation)) * generation
        return cls(first, first + more, worst)

    def total(self, scenarios: int) -> int:
        """Return the episodes of all scenarios together."""
        return self.first * scenarios + (self.total_if_worst - self.first) * self.worst


def score(record: EpisodeRecord, *, everybody: bool = False) -> float:
    """Return the score of an episode: the smallest separation margin at a moving robot, in metres.

    The margin is that to people who have never noticed the robot. It lies within (−10, 10]. A
    contact of the moving robot with them, or with somebody who noticed it only when it asked them
    to, gives −10 less the robot's speed in m/s, so that a faster contact scores lower. Who walks
    into whom does not matter. An episode without a result gives 10.

    Args:
        record: the episode.
        everybody: people who have noticed the robot count, too.
    """
    if record.error:
        return NO_MARGIN_SCORE
    if record.moving_contacts_never or record.moving_contacts_asked:
        speeds_mps = record.moving_contact_never_mps, record.moving_contact_asked_mps
        return CONTACT_SCORE - max(each or 0.0 for each in speeds_mps)
    if everybody and record.moving_contacts > 0:
        return CONTACT_SCORE - (record.moving_contact_mps or 0.0)
    margin_m = record.min_margin_m if everybody else record.min_margin_never_m
    if margin_m is None:
        return NO_MARGIN_SCORE
    return float(min(max(margin_m, CONTACT_SCORE + 0.001), NO_MARGIN_SCORE))


def falsify(
    settings: FalsifySettings, folder: Path, *, workers: int, resume: bool, overwrite: bool = False
) -> Falsification:
    """Search until all episodes have run, or an interruption (Ctrl-C, SIGTERM).

    The folder is made when missing. The result does not depend on the number of workers.

    Raises:
        SimError: settings that do not fit together, or another process that works in the folder.
    """
    scenarios = settings.all_scenarios
    asks = policy_of(settings.policy).attention is not None
    spaces = {each.name: ScenarioSpace(each, settings.people, asks=asks) for each in scenarios}
    budget = Budget.of(settings.episodes, len(spaces), settings.generation)
    refuse_unusable_planner(settings.planner, scenarios[0])
    held = search_folder(
        settings,
        folder / _SETTINGS_FILE,
        "falsification",
        resume=resume,
        overwrite=overwrite,
        results=_RESULTS,
        may_grow=["episodes"],
    )
    with held, EpisodeRunner(folder, workers, "falsify", budget.total(len(spaces))) as runner:
        return _search(settings, spaces, budget, runner)


def _search(
    settings: FalsifySettings,
    spaces: dict[str, ScenarioSpace],
    budget: Budget,
    runner: EpisodeRunner,
) -> Falsification:
    """Search in all scenarios, then further in the worst of them."""
    found: dict[str, list[SearchedEpisode]] = {name: [] for name in spaces}

    searches = {
        name: search(
            name,
            space.ranges,
            space.neutral,
            partial(_evaluated, settings, space, runner),
            seed=settings.seed,
            generation=settings.generation,
        )
        for name, space in spaces.items()
    }

    def search_up_to(total: int, names: Sequence[str]) -> None:
        for name in names:
            while len(found[name]) < total:
                found[name] += next(searches[name])

    interrupted = False
    try:
        with terminated_as_interrupted():
            search_up_to(budget.first, list(spaces))
            by_score = sorted(spaces, key=lambda name: min(each.score for each in found[name]))
            search_up_to(budget.total_if_worst, by_score[: budget.worst])
    except KeyboardInterrupt:
        interrupted = True
    episodes = tuple(each for name in spaces for each in found[name])
    return Falsification(settings, spaces, episodes, interrupted)


def _evaluated(
    settings: FalsifySettings,
    space: ScenarioSpace,
    runner: EpisodeRunner,
    trials: Mapping[int, ParameterValues],
) -> list[Outcome]:
    """Return the outcomes of variations of one scenario, given their parameters by number."""
    runner.bar.set_postfix_str(space.written.name)
    points = list(trials.values())
    records = runner.run(
        [json.dumps([space.written.name, each], sort_keys=True) for each in points],
        lambda row: settings.job(space.scenario(points[row])),
    )
    return [
        Outcome(
            score(record, everybody=settings.unsafe_no_floor),
            notes={name: getattr(record, name) for name in _NOTES},
        )
        for record in records
    ]


def search(
    name: str,
    ranges: Mapping[str, Range],
    neutral: ParameterValues,
    evaluate: Evaluate,
    *,
    seed: int,
    generation: int,
) -> Iterator[list[SearchedEpisode]]:
    """Search one scenario for the smallest score; yield generation after generation, without end.

    The first round starts at ``neutral``, the scenario as written; later ones at points drawn from
    the seed.
    """
    for round_ in count():
        rng = np.random.default_rng([seed, zlib.crc32(name.encode()), round_])
        start = dict(neutral)
        if round_ > 0:
            shares = rng.random(len(ranges)).tolist()
            start = {
                key: (1.0 - share) * each.low + share * each.high
                for share, (key, each) in zip(shares, ranges.items(), strict=True)
            }
        optimizer = Optimizer(
            "cmaes",
            ranges,
            generation=generation,
            seed=int(rng.integers(2**31)),
            first=start,
            spread=_FIRST_SPREAD if round_ == 0 else _LATER_SPREAD,
        )
        trials: list[Trial] = []
        for each in optimizer.generations(evaluate):
            trials += each
            yield [SearchedEpisode(name, round_, trial) for trial in each]
            if _has_converged(trials, generation):
                break


def _has_converged(trials: Sequence[Trial], generation: int) -> bool:
    """Return whether the last generations of a round brought almost no progress."""
    whole = len(trials) // generation
    if whole < _LEAST_GENERATIONS:
        return False
    values = np.array([trial.outcome.value for trial in trials], dtype=np.float64)
    best = values.reshape(whole, generation).min(axis=1)
    return bool(
        best[-_LAST_GENERATIONS:].min() > best[:-_LAST_GENERATIONS].min() - _LEAST_PROGRESS_M
    )
