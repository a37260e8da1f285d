"""Many episodes: in this process, in worker processes or on a cluster, with the same table."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from tqdm import tqdm

from perception.arrays import finite_number

from ...world.bullet import require_pybullet
from ...world.errors import SimError
from ..measures import EpisodeRecord
from ._episode import attempt, attempt_within, died, failed
from ._job import Attempt, Job, versions
from ._parallel import in_parallel
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
) -> tuple[EpisodeRecord, ...]:
    """Run episodes and write their table; the result does not depend on where they run.

    :class:`RunFiles` lists the files in ``out_dir``. Each episode that ends has a file at once. The
    tables are written at the end, and after an interruption (Ctrl-C, SIGTERM).
    ``episodes.parquet`` needs the extra ``bench``.

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

    Returns:
        The records in the order of the jobs; ``error`` of a record says why an episode failed.

    Raises:
        SimError: no jobs or no workers, the folder cannot be used (:class:`RunFolder`), or the
            extra ``sim`` is missing on this computer and there is no scheduler; nothing has run
            then.
    """
    if not jobs:
        raise SimError("jobs must be at least one episode, got none")
    if workers is not None:
        finite_number("workers", workers, SimError, minimum=1)
    function = attempt
    if time_limit_s is not None:
        limit_s = finite_number("time_limit_s", time_limit_s, SimError, minimum=1.0)
        function = partial(attempt_within, limit_s)
        if scheduler is not None:
            raise SimError("a time limit works in processes of this computer, not on a cluster")
    if scheduler is None:
        require_pybullet()
    else:
        function = partial(_attempt_with, versions())
    folder = RunFolder(
        Path(out_dir),
        jobs,
        {"versions": versions(), **(about or {})},
        resume=resume,
        overwrite=overwrite,
    )
    with folder, _terminated_as_interrupted():
        remaining = [number for number in range(len(jobs)) if number not in folder.done]
        outcomes = in_parallel(
            function,
            [jobs[number] for number in remaining],
            workers=workers,
            scheduler=scheduler,
            own_process=time_limit_s is not None,
            on_death=died,
        )
        try:
            with (
                contextlib.closing(outcomes),
                tqdm(
                    total=len(jobs),
                    initial=len(folder.done),
                    desc="crossings",
                    unit="episode",
                    smoothing=0.05,
                    file=sys.stderr,
                    disable=not progress,
                ) as bar,
            ):
                for place, outcome in outcomes:
                    folder.add(remaining[place], outcome)
                    bar.update()
        except BaseException:
            with contextlib.suppress(SimError):  # the first error says more
                folder.write_tables()
            raise
        return folder.write_tables()


def _attempt_with(needed: Mapping[str, str], job: Job) -> Attempt:
    """Run one episode on a worker of a cluster; refuse it there if a version differs."""
    own = versions()
    for name, version in needed.items():
        if own.get(name) != version:
            text = f"a worker has {name} {own.get(name)}, and the run was begun with {version}"
            return failed(job, f"SimError: {text}", text)
    return attempt(job)


@contextlib.contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    """Let SIGTERM interrupt the block as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
