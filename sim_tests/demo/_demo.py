"""The demonstration: the paper's encounter, then a crossing with and without awareness."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm

from awarenav.files import json_text
from perception import AwarenessPipeline, Camera
from perception.arrays import ImageRgb

from ..crossing import CrossingResult, run_crossing
from ..crossing.eyes import Perception
from ..scenario import Scenario, ScenarioTemplate
from ._cases import case_values
from ._comparison_plot import plot_comparison
from ._encounter import run_encounter
from ._film import PortraitRecorder, write_crossing_film
from ._film_values import FilmRun
from ._tables import EpisodeTable

#: Files of the film: for pages, and for players.
FILMS: Final = ("crossing.webp", "crossing.mp4")
# Rows of the comparison that the film shows: title, note and colour of the panel.
_PANELS: Final = {
    "today's AMR": ("Scanners only", "today's AMR", (31, 78, 121)),
    "aware, attentive worker": ("Aware robot", "worker watches it", (46, 125, 79)),
    "aware, distracted worker": ("Aware robot", "worker looks away", (190, 105, 25)),
}


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One row of the comparison.

    Attributes:
        label: of the row.
        result: the crossing.
        scenario: its scenario.
        portraits: the worker in the robot's camera, for the film; empty without a camera or a film.
    """

    label: str
    result: CrossingResult
    scenario: Scenario
    portraits: tuple[ImageRgb | None, ...] = ()


def compare_policies(
    seed: int = 0,
    perception: str = "keypoints",
    progress: bool = False,
    filmed: bool = False,
    *,
    robot: str = "",
    population: str = "",
) -> tuple[ComparisonRow, ...]:
    """Run the same crossing without people, as today, blind, and aware with two kinds of worker.

    Only the gaze and the robot's policy differ. A scripted worker walks the same path in every run;
    a recorded one begins the same, and then answers to the robot. The robot has a camera and laser
    scanners; today's robot has the scanners alone.

    Args:
        seed: seed of everything random.
        perception: ``"keypoints"`` or ``"pixels"``.
        progress: whether to show a progress bar, on a terminal.
        filmed: whether to take the pictures for the film.
        robot: a shipped name or a YAML file of the robot; empty for the Nova Carter.
        population: habits of the worker, as for ``run_crossing``; empty for the scenario's.

    Raises:
        SimError: an unknown robot or population.
    """
    attentive, distracted = _crossings(robot, population)
    both = Perception.of(perception, "camera+scanner").name
    alone = Perception.of(perception, "scanner").name
    runs = (
        ("nobody there", attentive.without_people(), "balanced", both),
        ("today's AMR", attentive, "scanner", alone),
        ("awareness-blind", attentive, "blind", both),
        ("aware, attentive worker", attentive, "balanced", both),
        ("aware, distracted worker", distracted, "balanced", both),
    )
    rows = []
    # None shows the bar on terminals only.
    hidden = None if progress else True
    with tqdm(runs, desc="crossings", unit="run", disable=hidden, file=sys.stderr) as bar:
        for label, scenario, policy, senses in bar:
            recorder = (
                PortraitRecorder(scenario)
                if filmed and label in _PANELS and senses != alone
                else None
            )
            result = run_crossing(
                scenario, policy=policy, perception=senses, seed=seed, observer=recorder
            )
            portraits = () if recorder is None else recorder.portraits
            rows.append(ComparisonRow(label, result, scenario, portraits))
    return tuple(rows)


def _crossings(robot: str, population: str) -> tuple[Scenario, Scenario]:
    """Return the crossings with an attentive and with a distracted worker."""
    attentive, distracted = (
        ScenarioTemplate.shipped(name).with_population(population).with_robot(robot).median()
        for name in ("crossing_attentive", "crossing_distracted")
    )
    return attentive, distracted


def film_runs(rows: tuple[ComparisonRow, ...]) -> tuple[FilmRun, ...]:
    """Return the panels of the film: today's AMR, and the aware robot with both workers."""
    return tuple(
        FilmRun(
            *_PANELS[row.label],
            row.result,
            row.scenario.layout.obstacle_boxes_odom,
            row.portraits,
        )
        for row in rows
        if row.label in _PANELS
    )


def comparison_table(rows: tuple[ComparisonRow, ...]) -> str:
    """Return the comparison as text."""
    header = (
        f"{'':26s}{'time to':>9s}{'smallest':>12s}{'top speed':>12s}{'margin':>12s}{'':>10s}\n"
        f"{'crossing':26s}{'goal':>9s}{'separation':>12s}{'within 2 m':>12s}{'violated':>12s}"
        f"{'contacts':>10s}"
    )
    lines = [header, "-" * 81]
    for row in rows:
        result = row.result
        goal = "never" if result.time_to_goal_s is None else f"{result.time_to_goal_s:.2f} s"
        empty = not result.frames or not result.frames[0].truth
        lines.append(
            f"{row.label:26s}{goal:>9s}"
            + (
                f"{'-':>12s}{'-':>12s}{'-':>12s}{'-':>10s}"
                if empty
                else f"{result.min_separation_m:>10.2f} m{result.max_speed_within_2m_mps:>8.2f} m/s"
                f"{result.violation_time_s:>10.2f} s{len(result.contacts):>10d}"
            )
        )
    return "\n".join(lines)


def delay_won_back(rows: tuple[ComparisonRow, ...]) -> float | None:
    """Return the share of the blind robot's delay that an aware robot does not have.

    None if one of the robots does not reach the goal, or the blind one has no delay.
    """
    free, _, blind, aware = (row.result.time_to_goal_s for row in rows[:4])
    if free is None or blind is None or aware is None or blind <= free:
        return None
    return (blind - aware) / (blind - free)


def encounter_table(result: CrossingResult) -> str:
    """Return the three cases of the encounter beside the paper's values, as text."""
    lines = [f"{'case':27s}{'':11s}{'alpha':>8s}{'d_fwd':>9s}{'d_lat':>9s}", "-" * 64]
    last = None
    for case, perception, alpha, forward, lateral in case_values(result):
        if case is not last:
            lines.append(
                f"{case.t_s:5.2f} s {case.meaning:19s}{'paper':11s}{case.awareness:8.2f}"
                f"{case.d_fwd_m:7.2f} m{case.d_lat_m:7.2f} m"
            )
            last = case
        cells = [
            "-" if value is None else f"{value:.2f}{unit}"
            for value, unit in ((alpha, ""), (forward, " m"), (lateral, " m"))
        ]
        lines.append(f"{'':27s}{perception:11s}{cells[0]:>8s}{cells[1]:>9s}{cells[2]:>9s}")
    return "\n".join(lines)


def _tables_as_data(
    encounter: CrossingResult, rows: tuple[ComparisonRow, ...], share: float | None
) -> dict[str, Any]:
    """Return both tables as plain data."""
    return {
        "encounter": [
            {
                "t_s": case.t_s,
                "meaning": case.meaning,
                "perception": perception,
                "awareness": alpha,
                "d_fwd_m": forward,
                "d_lat_m": lateral,
            }
            for case, perception, alpha, forward, lateral in case_values(encounter)
        ],
        "crossings": [
            {
                "crossing": row.label,
                "time_to_goal_s": row.result.time_to_goal_s,
                "min_separation_m": row.result.min_separation_m,
                "max_speed_within_2m_mps": row.result.max_speed_within_2m_mps,
                "violation_time_s": row.result.violation_time_s,
                "contacts": len(row.result.contacts),
            }
            for row in rows
        ],
        "delay_won_back": share,
    }


def run_demo(
    out: Path,
    *,
    seed: int = 0,
    video: bool = True,
    perception: str = "keypoints",
    robot: str = "",
    population: str = "",
    as_json: bool = False,
) -> None:
    """Run the demonstration and write its files.

    Args:
        out: folder for ``encounter.png``, ``encounter.mp4``, ``encounter.csv``, ``crossings.png``,
            ``episodes.csv``, ``crossing.webp`` and ``crossing.mp4``; made when missing.
        seed: seed of everything random.
        video: whether to render the films.
        perception: ``"keypoints"``, or ``"pixels"``: rendered images, through the shipped networks.
        robot: robot of the crossings, as for :func:`compare_policies`.
        population: likewise.
        as_json: print the tables as JSON.

    Raises:
        SimError: an unknown robot or population; nothing is written then.
    """
    _crossings(robot, population)  # refuses unknown names before anything runs
    if perception == "pixels":
        AwarenessPipeline(Camera.from_fov(640, 480, 1.0))  # fails now if networks are missing
    # With JSON on standard output, text goes to standard error.
    text_stream = sys.stderr if as_json else sys.stdout
    out.mkdir(parents=True, exist_ok=True)
    scenario = Scenario.shipped("paper_encounter")
    print(f"The encounter of the paper: {scenario.duration_s:g} s", file=text_stream)
    total = round(scenario.duration_s * scenario.control_hz)
    with tqdm(total=total, desc="encounter", unit="frame", disable=None, file=sys.stderr) as bar:

        def update_bar(finished: int) -> None:
            bar.update(finished - bar.n)

        encounter = run_encounter(
            out, seed=seed, video=video, perception=perception, progress=update_bar
        )
    print(encounter_table(encounter), file=text_stream)
    print("\nThe same crossing, with and without awareness", file=text_stream)
    rows = compare_policies(
        seed, perception, progress=True, filmed=video, robot=robot, population=population
    )
    with EpisodeTable(out / "episodes.csv") as table:
        for row in rows:
            table.add(row.result)
    plot_comparison(out / "crossings.png", [(row.label, row.result) for row in rows])
    print(comparison_table(rows), file=text_stream)
    share = delay_won_back(rows)
    if share is not None:
        print(
            f"\nAn attentive worker gives back {share:.0%} of the time that the blind robot loses.",
            file=text_stream,
        )
    if as_json:
        print(json_text(_tables_as_data(encounter, rows, share)), end="")
    if video:
        write_crossing_film([out / name for name in FILMS], film_runs(rows), rows[0].result)
    names = ["encounter.png", *(["encounter.mp4"] if video else []), "encounter.csv"]
    names += ["crossings.png", "episodes.csv", *(FILMS if video else [])]
    print(f"\nWritten to {out}: {', '.join(names)}", file=text_stream)
