"""What a falsification was asked for.

``awarenav falsify`` from its settings to what it found.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import yaml
from tqdm import tqdm

from ...scenario import Scenario, ScenarioTemplate
from ...study.measures import EpisodeRecord
from ...study.runs import Job, make_planner
from ...world.errors import SimError
from .._crew import Crew
from .._file_lock import FileLock
from .._search import Outcome, Parameters
from .._settings_file import keep_settings
from ._hunt import CONTACT, Find, Hunt, score
from ._no_floor import LABEL, PLANNER
from ._people_space import PeopleSpace


@dataclass(frozen=True, slots=True)
class FalsifySettings:
    """What a falsification was asked for.

    Attributes:
        policy_name: what tables call the policy.
        policy: YAML of the policy.
        scenarios: YAML of the templates.
        episodes: how many in all.
        people: how many people of a scenario are varied.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        planner: ``"module:Class"``, empty for the reference planner.
        seed: of every episode, and of the search.
        generation: episodes a generation of CMA-ES.
        unsafe_no_floor: the floor was taken away on purpose.
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


SETTINGS_FILE: Final = "falsify.json"
# Half of the episodes go to all scenarios alike, the rest to the worst third of them.
_FIRST_HALF: Final = 0.5
_SHARE_KEPT: Final = 3


@dataclass(frozen=True, slots=True)
class Falsification:
    """What a falsification came to.

    Attributes:
        settings: what was asked for.
        spaces: the variations, by scenario.
        finds: every episode, by scenario in the order in which they ran.
    """

    settings: FalsifySettings
    spaces: dict[str, PeopleSpace]
    finds: tuple[Find, ...]

    @property
    def contacts(self) -> int:
        """Episodes in which the robot moved into a person."""
        return sum(find.score <= CONTACT for find in self.finds)

    @property
    def errors(self) -> int:
        """Episodes without a result."""
        return sum(bool(find.notes.get("error")) for find in self.finds)


def falsify(
    settings: FalsifySettings, folder: Path, *, workers: int, resume: bool
) -> Falsification:
    """Search until the episodes asked for have run.

    Args:
        settings: what is asked for.
        folder: made when missing; holds the studies.
        workers: processes that run episodes; the result does not depend on their number.
        resume: go on with what is there.

    Raises:
        SimError: settings that do not go together, or another process that works in the folder.
    """
    templates = [ScenarioTemplate.from_text(text) for text in settings.scenarios]
    spaces = {each.name: PeopleSpace(each, settings.people) for each in templates}
    budget = _budget(settings, len(spaces))
    if settings.planner:
        make_planner(settings.planner, templates[0].median())  # says at once what is wrong with it
    keep_settings(settings, folder, SETTINGS_FILE, "falsification", resume=resume)
    with FileLock(folder / "locks" / "folder.lock", wait=False) as lock:
        if not lock.held:
            raise SimError(f"another process falsifies in {folder}")
        return _search(settings, folder, spaces, budget, workers)


def job_of(settings: FalsifySettings, scenario: Scenario) -> Job:
    """The episode that plays a variation."""
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
    """A concrete scenario as YAML."""
    data = scenario.model_dump(mode="json")
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=True)


def outcome_of(record: EpisodeRecord) -> Outcome:
    """What a search is told of an episode."""
    notes: dict[str, object] = {
        "min_margin_m": record.min_margin_m,
        "min_separation_m": record.min_separation_m,
        "contact_by": record.contact_by,
        "robot_contacts": record.robot_contacts,
        "contact_speed_mps": record.contact_speed_mps,
        "speed_at_min_separation_mps": record.speed_at_min_separation_mps,
        "awareness": record.awareness,
        "reaction": record.reaction,
        "error": record.error,
    }
    return Outcome((score(record),), notes=notes)


def _search(
    settings: FalsifySettings,
    folder: Path,
    spaces: dict[str, PeopleSpace],
    budget: tuple[int, int, int],
    workers: int,
) -> Falsification:
    first, more, kept = budget
    total = first * len(spaces) + (more - first) * kept
    with (
        tqdm(total=total, desc="falsify", unit="episode", file=sys.stderr) as bar,
        Crew(workers, lambda record: bar.update()) as crew,
    ):

        def hunt(name: str, space: PeopleSpace) -> Hunt:
            def evaluate(batch: Sequence[Parameters]) -> list[Outcome]:
                bar.set_postfix_str(name)
                jobs = [job_of(settings, space.scenario(parameters)) for parameters in batch]
                return [outcome_of(record) for record in crew.run(jobs)]

            return Hunt(
                name,
                space.ranges,
                space.neutral,
                evaluate,
                folder,
                seed=settings.seed,
                generation=settings.generation,
            )

        hunts = {name: hunt(name, space) for name, space in spaces.items()}
        found: dict[str, list[Find]] = {}

        def go_on(names: Sequence[str], episodes: int) -> None:
            for name in names:
                found[name] = hunts[name].run(episodes)
                done = sum(map(len, found.values()))
                if bar.n < done:  # what an earlier run had left
                    bar.update(done - bar.n)

        go_on(list(hunts), first)
        worst = sorted(hunts, key=lambda name: min(find.score for find in found[name]))
        go_on(worst[:kept], more)
    return Falsification(settings, spaces, tuple(find for name in hunts for find in found[name]))


def _budget(settings: FalsifySettings, scenarios: int) -> tuple[int, int, int]:
    """Episodes a scenario at first, in all for those that are kept, and how many are kept.

    Together at least as many as were asked for, in whole generations.
    """
    size = settings.generation
    if settings.episodes < size * scenarios:
        raise SimError(
            f"--episodes must be at least one generation of {size} a scenario, {size * scenarios} "
            f"for {scenarios}, got {settings.episodes}"
        )
    kept = max(scenarios // _SHARE_KEPT, 1)
    if scenarios == 1:
        return (math.ceil(settings.episodes / size) * size,) * 2 + (0,)
    first = max(int(_FIRST_HALF * settings.episodes / scenarios) // size, 1) * size
    more = math.ceil(max(settings.episodes - first * scenarios, 0) / (kept * size)) * size
    return first, first + more, kept
