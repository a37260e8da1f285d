"""Many episodes: in this process, in worker processes or on a cluster, with the same table."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from perception.arrays import finite_number

from ...world.errors import SimError
from ..measures import EpisodeRecord
from ._episode import Attempt
from ._job import Job, versions
from ._pool import NumberedJob, run_here, run_in_processes
from ._run_folder import RunFolder


def run_jobs(
    jobs: Sequence[Job],
    out_dir: Path | str,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    time_limit_s: float | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    about: Mapping[str, Any] | None = None,
    on_attempt: Callable[[int, Attempt], None] | None = None,
) -> tuple[EpisodeRecord, ...]:
    """Run episodes and write their table; the result does not depend on where they run.

    :class:`RunFiles` lists the files in ``out_dir``. While episodes run, the rows of
    ``episodes.csv`` are in the order in which episodes end; at the end they are in the order of
    the jobs. ``episodes.parquet`` needs the extra ``bench``.

    Args:
        jobs: the episodes, e.g. from :func:`plan_jobs`.
        out_dir: folder, made when missing.
        workers: number of processes; 1 runs in this process, None takes one per core.
        scheduler: address of a Dask scheduler (``"tcp://…"``), or ``"local"`` for a cluster of
            ``workers`` processes on this computer; None runs without Dask.
        time_limit_s: wall-clock limit of an episode; one that takes longer (a planner that hangs)
            is ended with an error. None for no limit; not with a scheduler.
        resume: continue the same run in ``out_dir``.
        overwrite: replace the run in ``out_dir``, which is refused otherwise.
        progress: show progress and the time left on standard error.
        about: command and settings, kept in ``run.json``.
        on_attempt: called with the number of a job and its outcome, before its row is written.

    Returns:
        The records in the order of the jobs; ``error`` of a record says why an episode failed.

    Raises:
        SimError: no jobs or no workers, or the folder cannot be used (:class:`RunFolder`); nothing
            has run then.
    """
    if not jobs:
        raise SimError("jobs must be at least one episode, got none")
    count = _cores() if workers is None else finite_number("workers", workers, SimError, minimum=1)
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
        overwrite=overwrite,
    )
    with folder:
        remaining = [(number, job) for number, job in enumerate(jobs) if number not in folder.done]
        with tqdm(
            total=len(jobs),
            initial=len(folder.done),
            desc="crossings",
            unit="episode",
            smoothing=0.05,
            file=sys.stderr,
            disable=not progress,
        ) as bar:
            for number, result in _results(remaining, int(count), scheduler, limit_s):
                if on_attempt is not None:
                    on_attempt(number, result)
                folder.add(number, result.record, result.traceback)
                bar.update()
        return folder.finish()


def _cores() -> int:
    """Return the number of cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # pragma: no cover - macOS and Windows
        return os.cpu_count() or 1


def _results(
    jobs: Sequence[NumberedJob], workers: int, scheduler: str | None, time_limit_s: float | None
) -> Iterator[tuple[int, Attempt]]:
    if scheduler is not None:
        from ._cluster import run_on_cluster  # noqa: PLC0415 - an optional dependency

        return run_on_cluster(jobs, scheduler, workers, versions())
    if workers == 1 and time_limit_s is None:
        return run_here(jobs)
    return run_in_processes(jobs, workers, time_limit_s)
