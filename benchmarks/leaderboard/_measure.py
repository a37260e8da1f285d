"""Measures rows of the leaderboard; results are kept episode by episode, a file per row."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm

import awarenav
from awarenav.files import write_text
from perception.documents import read_json
from sim_tests import SimError
from sim_tests.scenario import ScenarioTemplate
from sim_tests.study.measures import EpisodeRecord, read_records, write_records
from sim_tests.study.runs import Job, attempt, died, in_parallel, job_key, run_episode

from ._rows import RESULTS, Board, Row

_ABOUT_FILE: Final = "about.json"
# Differences that another kind of processor makes by rounding.
_SAME_TIME_S: Final = 0.25
_SAME_VIOLATION_S: Final = 0.15


def read_results(board: Board, row: Row, folder: Path = RESULTS) -> tuple[EpisodeRecord, ...]:
    """Return the episodes of a row that have been measured, in the order of the board.

    Episodes of another version of a scenario, or of a scenario or seed that the board does not
    have, are left out.
    """
    path = folder / f"{row.name}.csv"
    if not path.exists():
        return ()
    versions = {each.name: each.version for each in board.templates}
    order = {name: number for number, name in enumerate(versions)}
    kept = [
        record
        for record in read_records(path)
        if versions.get(record.scenario) == record.scenario_version and record.seed < board.seeds
    ]
    return tuple(sorted(kept, key=lambda record: (order[record.scenario], record.seed)))


def read_about(folder: Path = RESULTS) -> dict[str, dict[str, str]]:
    """Return by row with which version, commit and policy its results were measured, and when."""
    path = folder / _ABOUT_FILE
    return dict(read_json(path, SimError)) if path.exists() else {}


def measure(
    board: Board,
    rows: Sequence[Row],
    folder: Path = RESULTS,
    *,
    workers: int = 1,
    again: bool = False,
) -> None:
    """Run the episodes that are missing, the first seed of every row before the second.

    The files are written after every episode, so an interrupted run goes on where it stopped.

    Args:
        board: the board.
        rows: the rows to measure.
        folder: folder of the results.
        workers: number of processes.
        again: measure from the beginning.

    Raises:
        SimError: results of another policy, other sensors or another planner are in the way, or a
            planner cannot be made.
    """
    about = read_about(folder)
    records: dict[str, list[EpisodeRecord]] = {}
    for row in rows:
        path = folder / f"{row.name}.csv"
        if again:
            path.unlink(missing_ok=True)
        elif path.exists() and about.get(row.name, {}).get("digest") != row.digest:
            raise SimError(
                f"the results of {row.name!r} belong to another policy, other sensors or "
                "another planner; give --again to measure the row from the beginning"
            )
        records[row.name] = list(read_results(board, row, folder))
    jobs = [
        (row, job)
        for seed in range(board.seeds)
        for row in rows
        for job in row.jobs(board.templates, [seed])
        if not _has(records[row.name], job)
    ]
    owners = [row for row, _ in jobs]
    outcomes = in_parallel(attempt, [job for _, job in jobs], workers=workers, on_death=died)
    with tqdm(total=len(jobs), desc="leaderboard", unit="episode", file=sys.stderr) as bar:
        for number, outcome in outcomes:
            _keep(owners[number], outcome.record, records, folder)
            bar.update()


def remeasured(row: Row, scenario: str, seed: int) -> EpisodeRecord:
    """Return one episode of a row, measured now."""
    (job,) = row.jobs([ScenarioTemplate.shipped(scenario)], [seed])
    return run_episode(job)


def differences(committed: EpisodeRecord, now: EpisodeRecord) -> list[str]:
    """Return in what an episode differs from the committed one by more than rounding."""
    found = [
        f"{name}: committed {getattr(committed, name)}, now {getattr(now, name)}"
        for name in ("robot_contacts", "person_contacts", "success", "error")
        if getattr(committed, name) != getattr(now, name)
    ]
    for name, same_s in (("time_lost_s", _SAME_TIME_S), ("violation_time_s", _SAME_VIOLATION_S)):
        was, is_now = (getattr(each, name) for each in (committed, now))
        if (was is None) != (is_now is None) or (was is not None and abs(was - is_now) > same_s):
            found.append(f"{name}: committed {was} s, now {is_now} s")
    return found


def _has(records: Sequence[EpisodeRecord], job: Job) -> bool:
    key = job_key(job)
    return any((each.scenario, each.seed) == (key.scenario, key.seed) for each in records)


def _keep(
    row: Row,
    record: EpisodeRecord,
    records: dict[str, list[EpisodeRecord]],
    folder: Path,
) -> None:
    """Add an episode to the results of its row."""
    rows = records[row.name]
    earlier = read_about(folder)  # another process may measure other rows
    begun = earlier.get(row.name, {}) if rows else {}
    rows.append(record)
    rows.sort(key=lambda each: (each.scenario, each.seed))
    about = {**earlier, row.name: _about(row, begun)}
    write_text(folder / _ABOUT_FILE, _json(about), SimError)
    write_records(folder / f"{row.name}.csv", rows)


def _about(row: Row, begun: dict[str, str]) -> dict[str, str]:
    """Return what the results of a row were measured with.

    Args:
        row: the row.
        begun: the same of its earlier episodes, empty for the first.
    """
    commits = dict.fromkeys([*begun.get("commit", "").split(), _commit()])
    return {
        "version": awarenav.__version__,
        "commit": " ".join(commits),
        "date": date.today().isoformat(),
        "digest": row.digest,
    }


def _commit() -> str:
    """Return the short name of the commit, empty outside a checkout."""
    command = ["git", "rev-parse", "--short=10", "HEAD"]
    try:
        found = subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False
        )
    except OSError:
        return ""
    return found.stdout.strip() if found.returncode == 0 else ""


def _json(data: Any) -> str:
    return json.dumps(dict(sorted(data.items())), indent=1) + "\n"
