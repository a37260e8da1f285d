"""Runs as episodes of others' measures: recorded, measured, tabulated and exported."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from tqdm import tqdm

from awarenav.cli import table_text
from awarenav.errors import counted
from awarenav.files import json_text, write_text

from ...world.errors import SimError
from ..measures import EpisodeRecord, Variant, labels
from ..runs import (
    Job,
    RunFiles,
    attempt,
    find_episode,
    in_parallel,
    observed_episode,
    read_jobs,
    setup_of,
)
from ._episode import SocialEpisode, sides
from ._files import FORMATS, format_of, import_pandas, read_track, write_episode
from ._measures import SOCIAL_MEASURES, social_measures

if TYPE_CHECKING:
    import pandas as pd

#: Columns of ``social.csv`` before those of the measures.
KEY_COLUMNS: Final = (
    *("source", "episode", "scenario", "seed", "policy", "planner", "perception", "fault"),
    "error",
)
# The column of what a mean is over; it is in no file.
_LABEL: Final = "mean over"
# Failures that are printed.
_SHOWN: Final = 20


def episode_of(job: Job) -> tuple[SocialEpisode, EpisodeRecord]:
    """Run the episode of a job again; return its course and its row in the table."""
    result, record = observed_episode(job)
    task = setup_of(job).scenario.robot
    length, width = 2.0 * np.abs(result.robot.footprint_m).max(axis=0)
    episode = SocialEpisode(
        t_s=result.t_s,
        robot_m=result.robot_odom_m,
        robot_heading_rad=result.heading_odom_rad,
        robot_mps=np.array([frame.robot_state.velocity_odom_mps for frame in result.frames]),
        yaw_rate_radps=result.yaw_rate_radps,
        people_m=result.people_odom_m,
        people_heading_rad=result.people_heading_odom_rad,
        people_mps=result.people_odom_mps,
        robot_size_m=(float(length), float(width)),
        robot_radius_m=result.robot.circumscribed_radius_m,
        goal_m=np.array([task.goal_x_m, task.goal_y_m]),
        goal_tolerance_m=task.goal_tolerance_m,
        walls_m=sides(result.obstacle_boxes_odom_m),
        boxes_m=result.obstacle_boxes_odom_m,
        name=job.conditions.text,
        success=record.success,
        time_to_goal_s=result.time_to_goal_s,
        reference_time_s=result.time_without_people_s,
        reference_length_m=result.length_without_people_m,
        human_delay_s=record.human_delay_s,
    )
    return episode, record


def measure_sources(
    sources: Sequence[Path], *, workers: int | None, out: Path | None, as_json: bool
) -> int:
    """Measure runs and files, print means, and write a row for each episode.

    Returns:
        1 if an episode broke off with an error, else 0.

    Raises:
        SimError: a source is neither the folder of a run nor a file with an episode.
        MissingExtraError: pandas is not installed.
    """
    if out is not None and out.suffix != ".csv":
        raise SimError(f"--out must be a .csv file, got {out}")
    jobs = {path: read_jobs(path) for path in sources if path.is_dir()}
    frames = import_pandas("awarenav measures")
    rows = [_row_of_file(path) for path in sources if path not in jobs]
    for path, planned in jobs.items():
        rows += _rows_of_run(path, planned, workers)
    table = frames.DataFrame(rows, columns=[_LABEL, *KEY_COLUMNS, *SOCIAL_MEASURES])
    if out is None and len(sources) == 1 and jobs:
        out = RunFiles(sources[0]).social
    if out is not None:
        numbers = table.drop(columns=_LABEL).to_csv(index=False, float_format="%.6f")
        write_text(out, numbers, SimError)
    groups = table[table["error"] == ""].groupby(_LABEL, sort=False)[list(SOCIAL_MEASURES)]
    counts = groups.size().reindex(table[_LABEL].unique(), fill_value=0)
    means = groups.mean().reindex(counts.index)
    print(_json(counts, means) if as_json else _text(counts, means))
    if out is not None and not as_json:
        print(f"\nWritten: {out} with {counted(len(table), 'episode')}")
    failures = table[table["error"] != ""]
    for episode, error in failures[["episode", "error"]].head(_SHOWN).itertuples(index=False):
        print(f"episode {episode}: {error}", file=sys.stderr)
    return 1 if len(failures) else 0


def export_episode(folder: Path, episode: str, format: str | None, out: Path | None) -> int:
    """Run an episode of a run again and write it in a format that others read.

    Raises:
        SimError: the folder holds no run, the run does not have the episode, or the format is
            unknown.
    """
    jobs = read_jobs(folder)
    number = find_episode(jobs, episode)
    name = format or ("socnav3" if out is None else format_of(out))
    if out is None:
        out = RunFiles(folder).exports / f"episode_{number:05d}{FORMATS[name]}"
    elif out.suffix != FORMATS[name]:
        raise SimError(f"--format {name} writes files that end in {FORMATS[name]}, got {out}")
    found, _ = episode_of(jobs[number])
    write_episode(out, found, name)
    people = counted(found.people, "person", "people")
    print(f"Episode {number}: {found.name}")
    print(f"Written: {out} ({name}, {counted(len(found.t_s), 'instant')}, {people})")
    return 0


def _row_of_file(path: Path) -> dict[str, Any]:
    episode = read_track(path)
    key = {**dict.fromkeys(KEY_COLUMNS, ""), "source": str(path), "episode": episode.name}
    return {_LABEL: path.name, **key, **social_measures(episode)}


def _rows_of_run(folder: Path, jobs: Sequence[Job], workers: int | None) -> list[dict[str, Any]]:
    """Run all episodes of a run again and measure them."""
    by_number: dict[int, tuple[EpisodeRecord, dict[str, float | None]]] = {}
    with tqdm(total=len(jobs), desc="measures", unit="episode", file=sys.stderr) as bar:
        for number, each in in_parallel(_measured_job, jobs, workers=workers):
            by_number[number] = each
            bar.update()
    measured = [by_number[number] for number in range(len(jobs))]
    label = labels(Variant.of(record) for record, _ in measured)
    return [
        {
            _LABEL: label[Variant.of(record)],
            "source": str(folder),
            "episode": str(number),
            **{name: getattr(record, name) for name in KEY_COLUMNS[2:]},
            **values,
        }
        for number, (record, values) in enumerate(measured)
    ]


def _measured_job(job: Job) -> tuple[EpisodeRecord, dict[str, float | None]]:
    """Return record and measures of a job; an error becomes part of the record."""
    try:
        episode, record = episode_of(job)
    except Exception:  # a planner may raise anything; the attempt words the error as the run does
        record = attempt(job).record
        if record.error:
            return record, {}
        raise
    return record, social_measures(episode)


def _json(counts: pd.Series[int], means: pd.DataFrame) -> str:
    """Return the number of episodes and the mean of each measure, for each label."""
    known = means.astype(object).where(means.notna(), None)
    found = {
        label: {"episodes": int(counts[label]), "means": known.loc[label].to_dict()}
        for label in counts.index
    }
    return json_text(found).rstrip()


def _text(counts: pd.Series[int], means: pd.DataFrame) -> str:
    """Return the means as a table: a row for each measure, a column for each label."""
    rows = [["episodes", "", "", *map(str, counts)]]
    rows += [
        [name, measure.source, measure.published, *map(_number, means[name])]
        for name, measure in SOCIAL_MEASURES.items()
    ]
    return table_text(("mean of", "source", "its name there", *counts.index), rows, left=3)


def _number(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3f}"
