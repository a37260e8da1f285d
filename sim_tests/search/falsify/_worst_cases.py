"""The worst cases of a falsification: written as scenarios, run again and drawn."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from awarenav.errors import counted
from awarenav.figures import Circle, Polygon, Rectangle, new_figure, save_figure
from awarenav.files import write_text
from perception.documents import yaml_text

from ...conditions import Perception
from ...crossing import CrossingResult
from ...scenario import Scenario
from ...study.measures import EpisodeRecord
from ...study.runs import observed_episode
from ...world.errors import SimError
from .._study import Range
from ._search import CONTACT_SCORE, NO_MARGIN_SCORE, Falsification, FalsifySettings, SearchedEpisode

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Least difference between two cases of one scenario, in any parameter, as a share of its range.
_LEAST_DIFFERENCE: Final = 0.2
#: The falsified policy, in the folder of the worst cases.
POLICY_FILE: Final = "policy.yaml"
_PANELS: Final = 3
_ROBOT: Final = "#1f5fa8"
_PERSON: Final = "#d9822b"
_WORST: Final = "#b3261e"
_RACK: Final = "#c9ced4"
_ARROW_M: Final = 0.7


@dataclass(frozen=True, slots=True, eq=False)
class WorstCase:
    """One of the worst cases."""

    episode: SearchedEpisode
    path: Path
    scenario: Scenario
    result: CrossingResult
    record: EpisodeRecord

    @property
    def replays(self) -> bool:
        """True if the file gives the margin and the contacts of the search."""
        notes = self.episode.notes
        return (self.record.min_margin_never_m, self.record.moving_contacts) == (
            notes["min_margin_never_m"],
            notes["moving_contacts"],
        )


def worst_episodes(
    episodes: Sequence[SearchedEpisode], ranges: Mapping[str, Mapping[str, Range]], most: int
) -> list[SearchedEpisode]:
    """Return the episodes with the lowest scores, which differ in each scenario."""
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
        written = Scenario.from_yaml(path)
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
        for name in ("min_margin_never_m", "min_separation_m")
    )
    planner = settings.planner_of_jobs
    lines = [
        f"Found by falsification of {settings.policy_name} in {episode.scenario}, "
        f"round {episode.round}, trial {episode.trial.number}.",
        f"Smallest margin, never noticed, {margin}, smallest separation {separation}, contacts "
        f"with the moving robot {episode.notes['moving_contacts']}.",
        f"awarenav crossings --scenario {file} --policy {POLICY_FILE} "
        f"{Perception.named(settings.perception).options}"
        + (f" --planner {planner}" if planner else "")
        + f" --seed {settings.seed} --episodes 1 --out replay",
    ]
    if settings.unsafe_no_floor:
        lines.insert(0, "UNSAFE: the floor was taken away on purpose, in the simulation only.")
    return "".join(f"# {line}\n" for line in lines)


def draw_falsification(
    falsification: Falsification, cases: Sequence[WorstCase], path: Path
) -> None:
    """Draw the scores in the order of the search, and up to three worst cases from above."""
    figure = new_figure(13.0, 8.0)
    grid = figure.add_gridspec(2, _PANELS, height_ratios=(1.0, 1.2))
    _draw_course(figure.add_subplot(grid[0, :]), falsification)
    for column, case in enumerate(cases[:_PANELS]):
        axes = figure.add_subplot(grid[1, column])
        _draw_plan(axes, case)
        if column == 0:
            axes.plot([], [], color=_ROBOT, label="robot")
            axes.plot([], [], color=_PERSON, label="person, gaze red")
            axes.legend(loc="lower left", fontsize=8)
    save_figure(figure, path)


def _draw_course(axes: Axes, falsification: Falsification) -> None:
    """Draw the scores by scenario, the lowest so far as a line, and contacts as crosses."""
    places, middles = 0, dict.fromkeys(falsification.spaces, 0.0)
    for number, name in enumerate(middles):
        scores = np.array([each.score for each in falsification.episodes if each.scenario == name])
        x = places + np.arange(len(scores))
        places += len(scores)
        colour = f"C{number % 10}"
        touched = scores <= CONTACT_SCORE
        margins = (scores < NO_MARGIN_SCORE) & ~touched
        axes.scatter(x[margins], scores[margins], s=6, color=colour, alpha=0.6)
        if margins.any():
            lowest = np.minimum.accumulate(scores[margins])
            axes.plot(x[margins], lowest, color=colour, lw=1.4)
        bottom = np.full(int(touched.sum()), axes.get_ylim()[0])
        axes.scatter(x[touched], bottom, marker="x", color=_WORST)
        middles[name] = x.mean()
    axes.axhline(0.0, color=_WORST, lw=0.8, ls="--")
    settings = falsification.settings
    label = " with its floor taken away (UNSAFE)" if settings.unsafe_no_floor else ""
    axes.set_title(
        f"{counted(len(falsification.episodes), 'episode')} against {settings.policy_name}{label}: "
        f"{falsification.contacts} with a contact, never noticed (crosses)",
        loc="left",
        fontsize=10,
    )
    names = [name.replace("_", " ") for name in middles]
    level = len(names) == 1  # a scenario with few episodes is narrower than its name
    axes.set_xticks(list(middles.values()), names, fontsize=7, rotation=0 if level else 90)
    for number, tick in enumerate(axes.get_xticklabels()):
        tick.set_color(f"C{number % 10}")
    axes.set_xlabel("episodes by scenario, in the order of the search")
    axes.set_ylabel("smallest margin, never noticed (m)")
    axes.set_xlim(-0.5, places - 0.5)
    axes.grid(alpha=0.25)


def _draw_plan(axes: Axes, case: WorstCase) -> None:
    """Draw ways, robot, people and gazes at the first contact, or at the smallest margin."""
    frames, contacts, record = case.result.frames, case.result.contacts, case.record
    worst = int(np.argmin([frame.margin_m for frame in frames]))
    if contacts:
        worst = int(np.argmin([abs(frame.t_s - contacts[0].t_s) for frame in frames]))
    frame = frames[worst]
    for x_min, y_min, x_max, y_max in case.scenario.layout.obstacle_boxes_odom.tolist():
        axes.add_patch(Rectangle((x_min, y_min), x_max - x_min, y_max - y_min, color=_RACK))
    way = np.array([each.robot_state.position_odom_m for each in frames])
    axes.plot(*way.T, color=_ROBOT, lw=1.5)
    heading = frame.robot_state.heading_odom_rad
    cos, sin = math.cos(heading), math.sin(heading)
    outline = case.result.robot.footprint_m @ np.array([[cos, sin], [-sin, cos]]) + way[worst]
    axes.add_patch(Polygon(outline, facecolor=_ROBOT, alpha=0.8))
    for row, person in enumerate(frame.truth):
        walked = np.array([each.truth[row].position_odom_m for each in frames])
        axes.plot(*walked.T, color=_PERSON, lw=1.5)
        place, gaze = person.position_odom_m, frame.T_odom_camera[:2, :3] @ person.gaze_camera
        axes.add_patch(Circle((place[0], place[1]), 0.3, color=_PERSON, alpha=0.8))
        end = place + _ARROW_M * gaze / max(float(np.linalg.norm(gaze)), 1e-9)
        arrow = {"arrowstyle": "->", "color": _WORST}
        axes.annotate("", xy=tuple(end), xytext=tuple(place), arrowprops=arrow)
    middle = 0.5 * (way[worst] + frame.truth[0].position_odom_m) if frame.truth else way[worst]
    axes.set_xlim(middle[0] - 4.0, middle[0] + 4.0)
    axes.set_ylim(middle[1] - 4.0, middle[1] + 4.0)
    axes.set_aspect("equal")
    margin_m, touched = record.min_margin_never_m, record.contact_by
    speed_mps = contacts[0].robot_speed_mps if contacts else frame.robot_state.travel_mps
    axes.set_title(
        f"{case.path.stem}: {case.episode.scenario.replace('_', ' ')}\n"
        f"margin {'none' if margin_m is None else f'{margin_m:.2f} m'}"
        f"{f', {touched} touched' if touched else ''}, at {frame.t_s:.1f} s, robot "
        f"{speed_mps:.2f} m/s",
        fontsize=8,
        loc="left",
    )
    axes.set_xlabel("x odom (m)", fontsize=8)
    axes.tick_params(labelsize=8)
