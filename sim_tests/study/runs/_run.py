"""Runs many episodes: here, in processes, or on a cluster, with the same table in the end."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from perception.arrays import finite_number

from ...world.errors import SimError
from ..measures import EpisodeRecord
from ._episode import Attempt
from ._job import Job, versions
from ._pool import Numbered, run_here, run_in_processes
from ._run_folder import RunFolder


def run_jobs(
    jobs: Sequence[Job],
    out_dir: Path | str,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    time_limit_s: float | None = None,
    resume: bool = False,
    afresh: bool = False,
    progress: bool = False,
    about: Mapping[str, Any] | None = None,
) -> tuple[EpisodeRecord, ...]:
    """Run episodes and write their table; the result does not depend on where they ran.

    ``out_dir`` holds ``jobs.jsonl`` (a job a line), ``episodes.csv`` (a row an episode, while
    running in the order in which they end, at last in that of the jobs), ``episodes.parquet`` (with
    the extra ``bench``), ``run.json`` and, if something went wrong, ``errors.log``.

    Args:
        jobs: the episodes, e.g. from :func:`plan_jobs`.
        out_dir: folder, made when missing. A complete run in it is replaced.
        workers: processes; 1 runs in this one, None takes one a core.
        scheduler: a Dask scheduler's address (``"tcp://…"``), or ``"local"`` for a cluster of
            ``workers`` processes on this computer; None does without Dask.
        time_limit_s: by the clock, for an episode; one that takes longer (a planner that hangs) is
            ended and says so. None for no limit; not with a scheduler.
        resume: go on with the same run in ``out_dir``.
        afresh: replace an unfinished run in ``out_dir`` as well.
        progress: show on the standard error stream what is done and the time left.
        about: command and settings, kept in ``run.json``.

    Returns:
        The records in the order of the jobs; an episode that failed says why in ``error``.

    Raises:
        SimError: no jobs or no workers, or the folder cannot be used (:class:`RunFolder`); nothing
            has run then.
    """
    if not jobs:
        raise SimError("jobs must be at least one episode, got none")
    count = cores() if workers is None else finite_number("workers", workers, SimError, minimum=1)
    limit_s = time_limit_s
    if limit_s is not None:
        limit_s = finite_number("time_limit_s", limit_s, SimError, minimum=1.0)
        if scheduler is not None:
            raise SimError("a time limit works in processes of this computer, not on a cluster")
    folder = RunFolder(
        Path(out_dir),
        jobs,
        {"versions": versions(), **(about or {})},
        resume=resume,
        afresh=afresh,
    )
    with folder:
        left = [(number, job) for number, job in enumerate(jobs) if number not in folder.done]
        with tqdm(
            total=len(jobs),
            initial=len(folder.done),
            desc="crossings",
            unit="episode",
            smoothing=0.05,
            file=sys.stderr,
            disable=not progress,
        ) as bar:
            for number, result in _results(left, int(count), scheduler, limit_s):
                folder.add(number, result.record, result.trace)
                bar.update()
        return folder.finish()


def cores() -> int:
    """How many cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # pragma: no cover - not on this system
        return os.cpu_count() or 1


def _results(
    jobs: Sequence[Numbered], workers: int, scheduler: str | None, time_limit_s: float | None
) -> Iterator[tuple[int, Attempt]]:
    if scheduler is not None:
        from ._cluster import run_on_cluster  # noqa: PLC0415 - an extra, needed for this alone

        return run_on_cluster(jobs, scheduler, workers, versions())
    if workers == 1 and time_limit_s is None:
        return run_here(jobs)
    return run_in_processes(jobs, workers, time_limit_s)
