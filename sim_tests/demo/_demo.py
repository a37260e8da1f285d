"""The demonstration: the paper's encounter, then a crossing with and without awareness."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from awarenav.files import json_text
from perception import AwarenessPipeline, Camera

from ..crossing import CrossingResult, run_crossing
from ..crossing.eyes import Perception
from ..scenario import Scenario
from ._cases import case_values
from ._encounter import run_encounter
from ._figures import plot_comparison
from ._tables import EpisodeTable


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One row of the comparison: a label and the crossing."""

    label: str
    result: CrossingResult


def compare_policies(
    seed: int = 0, perception: str = "keypoints", progress: bool = False
) -> tuple[ComparisonRow, ...]:
    """Run the same crossing without people, as today, blind, and aware with two kinds of worker.

    The worker walks the same path in every run. Only the gaze and the robot's policy differ. The
    robot has a camera and laser scanners; today's robot has the scanners alone.
    """
    both = Perception.of(perception, "camera+scanner").name
    alone = Perception.of(perception, "scanner").name
    attentive = Scenario.shipped("crossing_attentive")
    distracted = Scenario.shipped("crossing_distracted")
    runs = (
        ("nobody there", attentive.without_people(), "balanced", both),
        ("today's AMR", attentive, "scanner", alone),
        ("awareness-blind", attentive, "blind", both),
        ("aware, attentive worker", attentive, "balanced", both),
        ("aware, distracted worker", distracted, "balanced", both),
    )
    rows = []
    with tqdm(runs, desc="crossings", unit="run", disable=not progress, file=sys.stderr) as bar:
        for label, scenario, policy, senses in bar:
            result = run_crossing(scenario, policy=policy, perception=senses, seed=seed)
            rows.append(ComparisonRow(label, result))
    return tuple(rows)


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
    as_json: bool = False,
) -> None:
    """Run the demonstration and write its files.

    Args:
        out: folder for ``encounter.png``, ``encounter.mp4``, ``encounter.csv``, ``crossings.png``
            and ``episodes.csv``; made when missing.
        seed: seed of everything random.
        video: whether to render the video.
        perception: ``"keypoints"``, or ``"pixels"``: rendered images, through the shipped networks.
        as_json: print the tables as JSON.
    """
    if perception == "pixels":
        AwarenessPipeline(Camera.from_fov(640, 480, 1.0))  # fails now if networks are missing
    # With JSON on standard output, text goes to standard error.
    text_stream = sys.stderr if as_json else sys.stdout
    out.mkdir(parents=True, exist_ok=True)
    scenario = Scenario.shipped("paper_encounter")
    print(f"The encounter of the paper: {scenario.duration_s:g} s", file=text_stream)
    total = round(scenario.duration_s * scenario.control_hz)
    with tqdm(total=total, desc="encounter", unit="frame", file=sys.stderr) as bar:

        def update_bar(finished: int) -> None:
            bar.update(finished - bar.n)

        encounter = run_encounter(
            out, seed=seed, video=video, perception=perception, progress=update_bar
        )
    print(encounter_table(encounter), file=text_stream)
    print("\nThe same crossing, with and without awareness", file=text_stream)
    rows = compare_policies(seed, perception, progress=True)
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
    names = ["encounter.png", *(["encounter.mp4"] if video else []), "encounter.csv"]
    written = ", ".join([*names, "crossings.png", "episodes.csv"])
    print(f"\nWritten to {out}: {written}", file=text_stream)
