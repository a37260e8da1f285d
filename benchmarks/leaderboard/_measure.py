"""Measures rows of the leaderboard as runs of crossings; the table of a run is a row's file."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Final

import awarenav
from awarenav.files import write_text
from perception.documents import read_json
from sim_tests import SimError
from sim_tests.study.measures import EpisodeRecord, read_records, write_records
from sim_tests.study.runs import RunFiles, run_jobs

from ._rows import RESULTS, WORK, Board, Row

_ABOUT_FILE: Final = "about.json"


def read_results(board: Board, row: Row, folder: Path = RESULTS) -> tuple[EpisodeRecord, ...]:
    """Return the episodes of a row that have been measured, in the order of the board.

    Episodes of another version of a scenario, or of a scenario or seed that the board does not
    have, are left out.
    """
    path = folder / f"{row.name}.csv"
    if not path.exists():
        return ()
    versions = {each.name: each.version for each in board.all_scenarios}
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
    work: Path = WORK,
    workers: int = 1,
    again: bool = False,
) -> None:
    """Run the episodes whose results are missing; an interrupted run goes on.

    Results of another version of a scenario count as missing.

    Args:
        board: the board.
        rows: the rows to measure.
        folder: folder of the results.
        work: folder of the runs, one folder a row.
        workers: number of processes.
        again: measure from the beginning.

    Raises:
        SimError: results of another policy, other sensors or another planner are in the way, or a
            planner cannot be made.
    """
    for row in rows:
        path = folder / f"{row.name}.csv"
        if again:
            path.unlink(missing_ok=True)
        elif path.exists() and read_about(folder).get(row.name, {}).get("digest") != row.digest:
            raise SimError(
                f"the results of {row.name!r} belong to another policy, other sensors or "
                "another planner; give --again to measure the row from the beginning"
            )
        kept = read_results(board, row, folder)
        done = {(each.scenario, each.seed) for each in kept}
        jobs = [
            job
            for job in row.jobs(board.all_scenarios, range(board.seeds))
            if (job.conditions.scenario, job.conditions.seed) not in done
        ]
        if not jobs:
            continue
        run = work / row.name
        begun = RunFiles(run).jobs.exists() and not again
        records = run_jobs(jobs, run, workers=workers, resume=begun, overwrite=again, progress=True)
        earlier = read_about(folder)
        about = {**earlier, row.name: _about(row, earlier.get(row.name, {}) if kept else {})}
        text = json.dumps(about, indent=1, sort_keys=True) + "\n"
        write_text(folder / _ABOUT_FILE, text, SimError)
        whole = sorted((*kept, *records), key=lambda each: (each.scenario, each.seed))
        write_records(path, whole)
        shutil.rmtree(run)  # what is measured later is another run


def _about(row: Row, earlier: Mapping[str, str]) -> dict[str, str]:
    """Return what a row was measured with; the commits of earlier episodes stand before today's."""
    commits = dict.fromkeys([*earlier.get("commit", "").split(), _commit()])
    return {
        "commit": " ".join(filter(None, commits)),
        "date": date.today().isoformat(),
        "digest": row.digest,
        "version": awarenav.__version__,
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
