"""Runs and files measured, and episodes of runs exported, for the command line."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm

from awarenav.errors import counted
from awarenav.files import csv_number, json_text, write_text

from ...world.errors import SimError
from ..measures import EpisodeRecord, Variant, labels, table_text
from ..runs import Job, RunFiles, attempt, find_episode, in_parallel, read_jobs
from ._files import FORMATS, format_of, read_track, write_episode
from ._measures import SOCIAL_MEASURES, social_measures
from ._recorder import episode_of

#: Columns of ``social.csv`` before those of the measures.
KEY_COLUMNS: Final = (
    *("source", "episode", "scenario", "seed", "policy", "planner", "perception", "fault"),
    "error",
)
_DECIMALS: Final = 3
# Failures that are printed.
_SHOWN: Final = 20


@dataclass(frozen=True, slots=True)
class MeasuredEpisode:
    """The measures of one episode: a row of ``social.csv``.

    Attributes:
        key: text of each of :data:`KEY_COLUMNS`.
        label: heading of its column in the table of means.
        values: by the names of the measures; empty for an episode that broke off.
    """

    key: dict[str, str]
    label: str
    values: dict[str, float | None]


def measure_sources(
    sources: Sequence[Path], *, workers: int | None, out: Path | None, as_json: bool
) -> int:
    """Measure runs and files, print means, and write a row for each episode.

    Returns:
        1 if an episode broke off with an error, else 0.

    Raises:
        SimError: a source is neither the folder of a run nor a file with an episode.
    """
    if out is not None and out.suffix != ".csv":
        raise SimError(f"--out must be a .csv file, got {out}")
    jobs = {path: read_jobs(path) for path in sources if path.is_dir()}
    rows = [_measured_file(path) for path in sources if path not in jobs]
    for path, planned in jobs.items():
        rows += _measured_run(path, planned, workers)
    if out is None and len(sources) == 1 and jobs:
        out = RunFiles(sources[0]).social
    if out is not None:
        write_text(out, social_csv(rows), SimError)
    means = _means(rows)
    print(json_text(means).rstrip() if as_json else _table(means))
    if out is not None and not as_json:
        print(f"\nWritten: {out} with {counted(len(rows), 'episode')}")
    failures = [row for row in rows if row.key["error"]]
    for row in failures[:_SHOWN]:
        print(f"episode {row.key['episode']}: {row.key['error']}", file=sys.stderr)
    return 1 if failures else 0


def social_csv(rows: Iterable[MeasuredEpisode]) -> str:
    """Return the text of ``social.csv``: one row per episode, six decimals, empty for None."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*KEY_COLUMNS, *SOCIAL_MEASURES])
    for row in rows:
        numbers = [csv_number(row.values.get(name)) for name in SOCIAL_MEASURES]
        writer.writerow([*(row.key[name] for name in KEY_COLUMNS), *numbers])
    return text.getvalue()


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


def _measured_file(path: Path) -> MeasuredEpisode:
    episode = read_track(path)
    key = {**dict.fromkeys(KEY_COLUMNS, ""), "source": str(path), "episode": episode.name}
    return MeasuredEpisode(key, path.name, social_measures(episode))


def _measured_run(folder: Path, jobs: Sequence[Job], workers: int | None) -> list[MeasuredEpisode]:
    """Run all episodes of a run again and measure them."""
    by_number: dict[int, tuple[EpisodeRecord, dict[str, float | None]]] = {}
    with tqdm(total=len(jobs), desc="measures", unit="episode", file=sys.stderr) as bar:
        for number, each in in_parallel(_measured_job, jobs, workers=workers):
            by_number[number] = each
            bar.update()
    measured = [by_number[number] for number in range(len(jobs))]
    label = labels(Variant.of(record) for record, _ in measured)
    return [
        MeasuredEpisode(
            {
                "source": str(folder),
                "episode": str(number),
                **{name: str(getattr(record, name)) for name in KEY_COLUMNS[2:]},
            },
            label[Variant.of(record)],
            values,
        )
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


def _means(rows: Sequence[MeasuredEpisode]) -> dict[str, Any]:
    """Return the number of episodes and the mean of each measure, for each label."""
    means: dict[str, Any] = {}
    for label in dict.fromkeys(row.label for row in rows):
        own = [row for row in rows if row.label == label and row.values]
        known = {
            name: [value for row in own if (value := row.values[name]) is not None]
            for name in SOCIAL_MEASURES
        }
        means[label] = {
            "episodes": len(own),
            "means": {name: sum(v) / len(v) if v else None for name, v in known.items()},
        }
    return means


def _table(means: dict[str, Any]) -> str:
    """Return the means as a table: a row for each measure, a column for each label."""

    def text(value: float | None) -> str:
        return "–" if value is None else f"{value:.{_DECIMALS}f}"

    rows = [["episodes", "", "", *(str(each["episodes"]) for each in means.values())]]
    rows += [
        [name, measure.source, measure.published, *(text(m["means"][name]) for m in means.values())]
        for name, measure in SOCIAL_MEASURES.items()
    ]
    return table_text(("mean of", "source", "its name there", *means), rows, left=3)
