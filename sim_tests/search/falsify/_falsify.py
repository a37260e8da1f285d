"""A falsification: the search over several scenarios for the smallest separation margins."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from perception.documents import yaml_text

from ...scenario import Scenario
from ...study.measures import EpisodeRecord
from ...study.runs import Job, policy_of, refuse_unusable_planner
from ...world.errors import SimError
from .._episode_runner import EpisodeRunner
from .._files import templates_of, write_or_check_settings
from .._optimizer import Outcome, ParameterValues
from .._process_lock import ProcessLock
from ._no_floor_planner import LABEL, PLANNER
from ._restarted_search import CONTACT_SCORE, EvaluatedTrial, RestartedSearch, score
from ._scenario_space import ScenarioSpace

_SETTINGS_FILE: Final = "falsify.json"
_RESULTS: Final = ("worst_*.yaml", "policy.yaml", "episodes.csv", "summary.json", "falsify.png")
# Share of the episodes that go to all scenarios alike; the rest go to the worst of them.
_FIRST_SHARE: Final = 0.5
# One scenario in so many is among the worst.
_WORST_ONE_IN: Final = 3


@dataclass(frozen=True, slots=True)
class FalsifySettings:
    """The settings of a falsification.

    Attributes:
        policy_name: name of the policy in tables.
        policy: YAML of the policy.
        scenarios: YAML of the templates.
        episodes: least number of episodes in all.
        people: number of people of a scenario that are varied.
        perception: as for :func:`sim_tests.run_crossing`.
        planner: ``"module:Class"``, empty for the reference planner.
        seed: seed of every episode, and of the search.
        generation: episodes per generation of CMA-ES.
        unsafe_no_floor: run the planner without the adapter's floor, on purpose.
    """

    policy_name: str
    policy: str
    scenarios: tuple[str, ...]
    episodes: int
    people: int
    perception: str
    planner: str
    seed: int
    generation: int
    unsafe_no_floor: bool = False


@dataclass(frozen=True, slots=True)
class Falsification:
    """The result of a falsification.

    Attributes:
        settings: its settings.
        spaces: search spaces by scenario.
        trials: every episode, by scenario, in the order in which they were proposed.
    """

    settings: FalsifySettings
    spaces: dict[str, ScenarioSpace]
    trials: tuple[EvaluatedTrial, ...]

    @property
    def contacts(self) -> int:
        """Number of episodes in which the moving robot touched a person who had not looked.

        Without the floor, people who had looked count, too.
        """
        return sum(trial.score <= CONTACT_SCORE for trial in self.trials)

    @property
    def contact_mps(self) -> float:
        """The robot's highest speed at one of these contacts; 0 without any."""
        return max(CONTACT_SCORE - min((t.score for t in self.trials), default=0.0), 0.0)

    @property
    def aware_contacts(self) -> int:
        """Number of episodes in which the moving robot touched a person who had looked."""
        return len(self._aware_speeds_mps)

    @property
    def aware_contact_mps(self) -> float:
        """The robot's highest speed in one of these episodes at a contact; 0 without any."""
        return max(self._aware_speeds_mps, default=0.0)

    @property
    def _aware_speeds_mps(self) -> list[float]:
        return [
            float(trial.notes.get("moving_contact_mps") or 0.0)
            for trial in self.trials
            if trial.notes.get("moving_contacts", 0) > trial.notes.get("moving_contacts_unaware", 0)
        ]

    @property
    def errors(self) -> int:
        """Number of episodes without a result."""
        return sum(bool(trial.notes.get("error")) for trial in self.trials)


@dataclass(frozen=True, slots=True)
class Budget:
    """The episodes of a falsification, in whole generations.

    Attributes:
        first: episodes in every scenario.
        total_if_worst: episodes in each of the worst scenarios, the first ones included.
        worst: number of the worst scenarios.
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


def falsify(
    settings: FalsifySettings,
    folder: Path,
    *,
    workers: int,
    resume: bool,
    overwrite: bool = False,
) -> Falsification:
    """Search until all episodes have run.

    Args:
        settings: settings of the search.
        folder: made when missing; holds the studies.
        workers: number of processes that run episodes; the result does not depend on it.
        resume: continue the search in the folder.
        overwrite: replace the search in the folder.

    Raises:
        SimError: settings that do not fit together, or another process that works in the folder.
    """
    templates = templates_of(settings.scenarios)
    asks = policy_of(settings.policy).attention is not None
    spaces = {each.name: ScenarioSpace(each, settings.people, asks=asks) for each in templates}
    budget = Budget.of(settings.episodes, len(spaces), settings.generation)
    refuse_unusable_planner(settings.planner, templates[0].median())
    write_or_check_settings(
        settings,
        folder,
        _SETTINGS_FILE,
        "falsification",
        resume=resume,
        overwrite=overwrite,
        results=_RESULTS,
        may_grow=["episodes"],
    )
    with ProcessLock(folder / "locks" / "folder.lock", wait=False) as lock:
        if not lock.held:
            raise SimError(f"another process falsifies in {folder}")
        with EpisodeRunner(workers, "falsify", budget.total(len(spaces))) as runner:
            return _search(settings, folder, spaces, budget, runner)


def job_of(settings: FalsifySettings, scenario: Scenario) -> Job:
    """Return the job of a variation."""
    name = settings.policy_name + (f" {LABEL}" if settings.unsafe_no_floor else "")
    return Job(
        scenario=scenario_text(scenario),
        seed=settings.seed,
        policy_name=name,
        policy=settings.policy,
        planner=PLANNER if settings.unsafe_no_floor else settings.planner,
        perception=settings.perception,
    )


def scenario_text(scenario: Scenario) -> str:
    """Return a concrete scenario as YAML."""
    data = scenario.model_dump(mode="json")
    return yaml_text(data)


def _search(
    settings: FalsifySettings,
    folder: Path,
    spaces: dict[str, ScenarioSpace],
    budget: Budget,
    runner: EpisodeRunner,
) -> Falsification:
    """Search in all scenarios, then further in the worst of them."""
    searches = {
        name: RestartedSearch(
            name,
            space.ranges,
            space.neutral,
            _evaluator(settings, space, runner),
            folder,
            seed=settings.seed,
            generation=settings.generation,
        )
        for name, space in spaces.items()
    }
    trials: dict[str, list[EvaluatedTrial]] = {}

    def search_up_to(episodes: int, names: Sequence[str]) -> None:
        for name in names:
            trials[name] = searches[name].run(episodes)
            done = sum(map(len, trials.values()))
            if runner.bar.n < done:  # episodes of an earlier process
                runner.bar.update(done - runner.bar.n)

    search_up_to(budget.first, list(searches))
    by_score = sorted(searches, key=lambda name: min(trial.score for trial in trials[name]))
    search_up_to(budget.total_if_worst, by_score[: budget.worst])
    return Falsification(
        settings, spaces, tuple(trial for name in searches for trial in trials[name])
    )


def _evaluator(
    settings: FalsifySettings, space: ScenarioSpace, runner: EpisodeRunner
) -> Callable[[Sequence[ParameterValues]], list[Outcome]]:
    """Return the function that runs the variations of one scenario."""

    def evaluate(batch: Sequence[ParameterValues]) -> list[Outcome]:
        runner.bar.set_postfix_str(space.template.name)
        jobs = [job_of(settings, space.scenario(values)) for values in batch]
        return [_outcome(each, settings.unsafe_no_floor) for each in runner.run(jobs)]

    return evaluate


def _outcome(record: EpisodeRecord, everybody: bool) -> Outcome:
    notes: dict[str, object] = {
        "min_margin_unaware_m": record.min_margin_unaware_m,
        "min_separation_m": record.min_separation_m,
        "contact_by": record.contact_by,
        "moving_contacts": record.moving_contacts,
        "moving_contacts_unaware": record.moving_contacts_unaware,
        "moving_contact_mps": record.moving_contact_mps,
        "speed_at_min_separation_mps": record.speed_at_min_separation_mps,
        "awareness": record.awareness,
        "reaction": record.reaction,
        "error": record.error,
    }
    return Outcome((score(record, everybody=everybody),), notes=notes)
