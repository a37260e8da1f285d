"""The demonstration: the paper's encounter, then a crossing with and without awareness."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from awarenav.files import json_text
from perception import AwarenessPipeline, Camera

from ..crossing import CrossingResult
from ..study.measures import measure, write_records
from ..world.bullet import require_pybullet
from ._comparison import (
    ComparisonRow,
    compare_policies,
    compared_scenarios,
    comparison_table,
    delay_won_back,
    plot_comparison,
)
from ._encounter import case_values, encounter_table, run_encounter
from ._film import write_crossing_film

#: Files of the film: for pages, and for players.
FILMS: Final = ("crossing.webp", "crossing.mp4")


def run_demo(
    out: Path,
    *,
    seed: int,
    video: bool,
    perception: str,
    axes: Mapping[str, str],
    as_json: bool,
) -> None:
    """Run the demonstration and write its files.

    Args:
        out: folder for ``encounter.png``, ``encounter.mp4``, ``encounter.csv``, ``crossings.png``,
            ``episodes.csv``, ``crossing.webp`` and ``crossing.mp4``; made when missing.
        seed: seed of everything random.
        video: whether to render the films.
        perception: ``"keypoints"``, or ``"pixels"``: rendered images, through the shipped networks.
        axes: robot and population of the crossings, as for :func:`compare_policies`.
        as_json: print the tables as JSON.

    Raises:
        SimError: an unknown robot or population; nothing is written then.
    """
    require_pybullet()
    compared_scenarios(axes)  # refuses unknown names before anything runs
    if perception == "pixels":
        AwarenessPipeline(Camera.from_fov(640, 480, 1.0))  # fails now if networks are missing
    # With JSON on standard output, text goes to standard error.
    text_stream = sys.stderr if as_json else sys.stdout
    out.mkdir(parents=True, exist_ok=True)
    print("The encounter of the paper: 25 s", file=text_stream)
    encounter = run_encounter(out, seed=seed, video=video, perception=perception)
    print(encounter_table(encounter), file=text_stream)
    print("\nThe same crossing, with and without awareness", file=text_stream)
    rows = compare_policies(seed, perception, filmed=video, **axes)
    write_records(out / "episodes.csv", [measure(row.result) for row in rows])
    plot_comparison(out / "crossings.png", rows)
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
        write_crossing_film([out / name for name in FILMS], rows)
    names = ["encounter.png", *(["encounter.mp4"] if video else []), "encounter.csv"]
    names += ["crossings.png", "episodes.csv", *(FILMS if video else [])]
    print(f"\nWritten to {out}: {', '.join(names)}", file=text_stream)


def _tables_as_data(
    encounter: CrossingResult, rows: Sequence[ComparisonRow], share: float | None
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
            for case, perception, (alpha, forward, lateral) in case_values(encounter)
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
