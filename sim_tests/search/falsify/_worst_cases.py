"""The worst cases of a falsification, written as scenarios that can be run again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.files import write_text
from perception.documents import yaml_text

from ...conditions import Perception
from ...crossing import CrossingResult
from ...scenario import Scenario, ScenarioTemplate
from ...study.measures import EpisodeRecord
from ...study.runs import observed_episode
from ...world.errors import SimError
from .._study import Range
from ._search import NO_MARGIN_SCORE, Falsification, FalsifySettings, SearchedEpisode

# Least difference between two cases of one scenario, in any parameter, as a share of its range.
_LEAST_DIFFERENCE: Final = 0.2
#: The falsified policy, in the folder of the worst cases.
POLICY_FILE: Final = "policy.yaml"


@dataclass(frozen=True, slots=True, eq=False)
class WorstCase:
    """One of the worst cases.

    Attributes:
        episode: the episode of the search.
        path: the file of its scenario.
        scenario: the scenario, as read from the file.
        result: the crossing, run from the file.
        record: the record of that crossing.
    """

    episode: SearchedEpisode
    path: Path
    scenario: Scenario
    result: CrossingResult
    record: EpisodeRecord

    @property
    def replays(self) -> bool:
        """True if the file gives the margin and the contacts of the search."""
        notes = self.episode.notes
        return (self.record.min_margin_unaware_m, self.record.moving_contacts) == (
            notes["min_margin_unaware_m"],
            notes["moving_contacts"],
        )


def worst_episodes(
    episodes: Sequence[SearchedEpisode], ranges: Mapping[str, Mapping[str, Range]], most: int
) -> list[SearchedEpisode]:
    """Return the episodes with the lowest scores, which differ in each scenario.

    Args:
        episodes: episodes to choose from.
        ranges: ranges of the parameters, by scenario.
        most: number of episodes to return at most.
    """
    worst: list[SearchedEpisode] = []
    for each in sorted(episodes, key=lambda each: each.score):
        if len(worst) == most or each.score >= NO_MARGIN_SCORE:
            break
        if all(
            other.scenario != each.scenario
            or _difference(each, other, ranges[each.scenario]) >= _LEAST_DIFFERENCE
            for other in worst
        ):
            worst.append(each)
    return worst


def write_worst(falsification: Falsification, folder: Path, most: int) -> list[WorstCase]:
    """Write ``worst_001.yaml`` and so on beside ``policy.yaml``, and run each from its file."""
    settings, spaces = falsification.settings, falsification.spaces
    write_text(folder / POLICY_FILE, settings.policy, SimError)
    for old in folder.glob("worst_*.yaml"):
        old.unlink()
    cases = []
    ranges = {name: space.ranges for name, space in spaces.items()}
    worst = worst_episodes(falsification.episodes, ranges, most)
    for number, episode in enumerate(worst, start=1):
        scenario = spaces[episode.scenario].scenario(episode.trial.parameters)
        start = scenario.description.rstrip(".")
        about = {
            "name": f"{episode.scenario}_worst_{number:03d}",
            "description": f"{start}; as a search of {settings.policy_name} made it worst.",
        }
        path = folder / f"worst_{number:03d}.yaml"
        text = yaml_text(scenario.model_copy(update=about).model_dump(mode="json"))
        write_text(path, _header(episode, settings, path.name) + text, SimError)
        written = ScenarioTemplate.from_yaml(path).median()
        result, record = observed_episode(settings.job(written))
        cases.append(WorstCase(episode, path, written, result, record))
    return cases


def _difference(
    first: SearchedEpisode, second: SearchedEpisode, ranges: Mapping[str, Range]
) -> float:
    """Return the largest difference in a parameter, as a share of its range."""
    one, other = first.trial.parameters, second.trial.parameters
    shares = [(one[name] - other[name]) / (each.high - each.low) for name, each in ranges.items()]
    return float(np.max(np.abs(shares)))


def _header(episode: SearchedEpisode, settings: FalsifySettings, file: str) -> str:
    """Return the comment at the top of a worst case: its figures, and how to run it again."""
    margin, separation = (
        "none" if episode.notes[name] is None else f"{episode.notes[name]:.3f} m"
        for name in ("min_margin_unaware_m", "min_separation_m")
    )
    planner = settings.planner_of_jobs
    lines = [
        f"Found by falsification of {settings.policy_name} in {episode.scenario}, "
        f"round {episode.round}, trial {episode.trial.number}.",
        f"Smallest margin of unaware people {margin}, smallest separation {separation}, contacts "
        f"with the moving robot {episode.notes['moving_contacts']}.",
        f"awarenav crossings --scenario {file} --policy {POLICY_FILE} "
        f"{Perception.named(settings.perception).options}"
        + (f" --planner {planner}" if planner else "")
        + f" --seed {settings.seed} --episodes 1 --out replay",
    ]
    if settings.unsafe_no_floor:
        lines.insert(0, "UNSAFE: the floor was taken away on purpose, in the simulation only.")
    return "".join(f"# {line}\n" for line in lines)
