"""The demonstration: four robots in an aisle, or the paper's encounter."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm

from awarenav.errors import counted
from awarenav.files import json_text, write_text
from perception import AwarenessPipeline, Camera

from ..crossing import CrossingResult
from ..world.bullet import require_pybullet
from ..world.errors import SimError
from ._camera_film import CameraRecorder
from ._encounter import case_values, encounter_table, run_encounter
from ._film import ComparisonRow, write_crossing_film
from ._lanes import (
    LANES,
    REPORTED,
    LaneRow,
    lanes_table,
    legend,
    read_report,
    report_text,
    run_lane,
    run_nobody,
    shown_seed,
)

#: Files of the film: for pages, and for players.
FILMS: Final = ("crossing.webp", "crossing.mp4")
_ROWS: Final = "lanes.jsonl"


def run_demo(out: Path, *, seed: int | None, video: bool, as_json: bool) -> None:
    """Run the robots with a seed (None: the median one reported), film and print them."""
    require_pybullet()
    about, reported = read_report()
    median = shown_seed(reported)
    seed = median if seed is None else seed
    camera = CameraRecorder() if video else None
    runs = [
        run_lane(lane, seed, camera if lane is LANES[-1] else None)
        for lane in tqdm(LANES, desc="robots", unit="robot", disable=None, file=sys.stderr)
    ]
    rows = [run.row for run in runs]
    _write_rows(out, rows)
    # With JSON on standard output, text goes to standard error.
    text_stream = sys.stderr if as_json else sys.stdout
    note = f", the median one of {REPORTED} by awarenav's time lost" if seed == median else ""
    print(
        "An aisle: one worker watches the robot, another with a phone steps out.\n\n"
        f"Seed {seed}{note}:\n\n{lanes_table(rows)}\n\n"
        f"Seeds 0 to {REPORTED - 1}, measured {about['date']} with version {about['version']}:\n\n"
        f"{lanes_table(reported)}\n\n{legend(REPORTED)}",
        file=text_stream,
    )
    if as_json:
        tables = {"seed": seed, "shown": [*map(asdict, rows)], "reported": [*map(asdict, reported)]}
        print(json_text(tables), end="")
    if camera is None:
        print(f"\nOpen {out / _ROWS}", file=text_stream)
        return
    free = run_nobody(seed)
    films = [ComparisonRow("nobody there", free, runs[0].scenario)]
    for run in runs:
        pictures = camera.pictures if run.lane is LANES[-1] else ()
        films.append(ComparisonRow(run.lane.name, run.result, run.scenario, pictures))
    write_crossing_film([out / name for name in FILMS], films)
    print(f"\nOpen {out / FILMS[1]}", file=text_stream)


def run_seeds(out: Path, *, seeds: int, as_json: bool) -> None:
    """Run the four robots with the seeds 0, 1, … and print their table."""
    require_pybullet()
    pairs = [(seed, lane) for seed in range(seeds) for lane in LANES]
    bar = tqdm(pairs, desc="crossings", unit="crossing", disable=None, file=sys.stderr)
    rows = [run_lane(lane, seed).row for seed, lane in bar]
    _write_rows(out, rows)
    print(
        f"{counted(seeds, 'seed')}; the median one by awarenav's time lost is {shown_seed(rows)}"
        f"\n\n{lanes_table(rows)}\n\n{legend(seeds)}\n\nOpen {out / _ROWS}",
        file=sys.stderr if as_json else sys.stdout,
    )
    if as_json:
        print(json_text([asdict(row) for row in rows]), end="")


def _write_rows(out: Path, rows: list[LaneRow]) -> None:
    out.mkdir(parents=True, exist_ok=True)
    write_text(out / _ROWS, report_text(rows), SimError)


def run_paper(out: Path, *, seed: int, video: bool, perception: str, as_json: bool) -> None:
    """Run the paper's encounter and write its files."""
    require_pybullet()
    if perception == "pixels":
        # Fails now if networks are missing.
        AwarenessPipeline(Camera.from_fov(640, 480, 1.0), simulator_networks=True)
    out.mkdir(parents=True, exist_ok=True)
    encounter = run_encounter(out, seed=seed, video=video, perception=perception)
    print(
        f"The encounter of the paper: 25 s\n{encounter_table(encounter)}\n\n"
        f"Open {out / ('encounter.mp4' if video else 'encounter.png')}",
        file=sys.stderr if as_json else sys.stdout,
    )
    if as_json:
        print(json_text(_cases_as_data(encounter)), end="")


def _cases_as_data(encounter: CrossingResult) -> list[dict[str, Any]]:
    return [
        {
            "t_s": case.t_s,
            "meaning": case.meaning,
            "perception": perception,
            "awareness": alpha,
            "d_fwd_m": forward,
            "d_lat_m": lateral,
        }
        for case, perception, (alpha, forward, lateral) in case_values(encounter)
    ]
