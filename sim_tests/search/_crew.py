"""Processes that run episodes, for as long as a search lasts."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

from .._closing import Closing
from .._errors import SimError
from ..measures._episode_record import EpisodeRecord
from ..runs._job import Job
from ._episode import run_episode


class Crew(Closing):
    """Runs episodes on some processes; results come in the order of the jobs.

    Args:
        workers: how many processes; 1 runs everything in this one.
        each: called after every episode, e.g. to move a bar.
    """

    def __init__(self, workers: int, each: Callable[[], object] = lambda: None) -> None:
        self._each = each
        self._pool: ProcessPoolExecutor | None = None
        if workers > 1:
            # Not forked: a child would inherit the locks of a search and outlive a kill with them.
            self._pool = ProcessPoolExecutor(
                workers,
                multiprocessing.get_context("spawn"),
                initializer=_begin,
                initargs=(os.getpid(),),
            )

    def close(self) -> None:
        """End the processes; what has not begun is dropped."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def run(self, jobs: Sequence[Job]) -> tuple[EpisodeRecord, ...]:
        """Run the jobs.

        Raises:
            SimError: when a process was killed; what is finished elsewhere stays.
        """
        records = []
        try:
            results = map(run_episode, jobs) if self._pool is None else self._pool.map(run_episode, jobs)
            for record in results:
                records.append(record)
                self._each()
        except BrokenProcessPool as cause:
            raise SimError(
                "a worker process ended unasked, perhaps for want of memory; "
                "start again with --resume, with fewer --workers"
            ) from cause
        return tuple(records)


def _begin(parent: int) -> None:
    """Leave Ctrl-C to the parent, and end when it has ended, however it did."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
