"""Worker processes on this computer; one that dies costs the episode it was at, and no other."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import multiprocessing
import os
import signal
import time
from collections import deque
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from typing import Final, cast

from awarenav.closing import Closing

from ._episode import Attempt, attempt, failed
from ._job import Job

Numbered = tuple[int, Job]

# Libraries that would take every core for one episode.
_THREAD_SETTINGS: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)
_DEATHS_ALLOWED: Final = 1


def run_here(jobs: Sequence[Numbered]) -> Iterator[tuple[int, Attempt]]:
    """Run jobs one after another in this process."""
    for number, job in jobs:
        yield number, attempt(job)


def run_in_processes(
    jobs: Sequence[Numbered], workers: int, time_limit_s: float | None = None
) -> Iterator[tuple[int, Attempt]]:
    """Run jobs in processes of their own, and give each result as soon as it is there.

    See :class:`WorkerPool`; the processes live as long as this takes.

    Args:
        jobs: with their numbers.
        workers: how many processes, ≥ 1.
        time_limit_s: as in :class:`WorkerPool`.
    """
    with WorkerPool(min(workers, len(jobs)), time_limit_s) as pool:
        yield from pool.run(jobs)


class WorkerPool(Closing):
    """Processes that live on from one lot of jobs to the next.

    An episode whose process dies (killed, out of memory, a crash in compiled code) is run once
    more; if it dies again, that is its result.

    Args:
        workers: how many.
        time_limit_s: an episode that takes longer by the clock is ended, and not run again; None
            lets each take its time.
    """

    def __init__(self, workers: int, time_limit_s: float | None = None) -> None:
        self._time_limit_s = time_limit_s
        self._context = multiprocessing.get_context("spawn")  # a fork would share the physics
        with _one_thread_each():
            self._idle = [_Worker(self._context) for _ in range(workers)]
        self._busy: dict[Connection, tuple[_Worker, int, Job, int]] = {}

    def close(self) -> None:
        """End the processes, whatever they are at."""
        _close_all(self._idle, self._busy)
        self._idle, self._busy = [], {}

    def run(self, jobs: Sequence[Numbered]) -> Iterator[tuple[int, Attempt]]:
        """Run jobs, and give each result as soon as it is there; one lot at a time."""
        waiting = deque((number, job, 0) for number, job in jobs)
        idle, busy = self._idle, self._busy
        while waiting or busy:
            while waiting and idle:
                number, job, deaths = waiting.popleft()
                worker = idle.pop()
                busy[worker.pipe] = (worker, number, job, deaths)
                worker.give(job)
            ready = cast(
                list[Connection], wait(list(busy), None if self._time_limit_s is None else 1)
            )
            overdue = self._overdue(ready)
            for pipe in ready:
                worker, number, job, deaths = busy.pop(pipe)
                result = worker.take()
                if result is not None:
                    idle.append(worker)
                    yield number, result
                    continue
                self._replace(worker)
                if deaths < _DEATHS_ALLOWED:
                    waiting.appendleft((number, job, deaths + 1))
                else:
                    yield number, died(job, worker.exit_code)
            for pipe in overdue:
                worker, number, job, _ = busy.pop(pipe)
                self._replace(worker)
                yield number, self._ended(job)

    def _replace(self, worker: _Worker) -> None:
        worker.close()
        with _one_thread_each():
            self._idle.append(_Worker(self._context))

    def _overdue(self, ready: Sequence[Connection]) -> list[Connection]:
        limit_s = self._time_limit_s
        if limit_s is None:
            return []
        latest_s = time.monotonic() - limit_s
        return [
            pipe
            for pipe, (worker, *_) in self._busy.items()
            if pipe not in ready and worker.since_s < latest_s
        ]

    def _ended(self, job: Job) -> Attempt:
        text = f"ended after the time limit of {self._time_limit_s:g} s"
        return failed(job, f"TimeLimit: {text}", text)


def _close_all(idle: list[_Worker], busy: dict[Connection, tuple[_Worker, int, Job, int]]) -> None:
    for worker in [*idle, *(each for each, *_ in busy.values())]:
        worker.close()


def died(job: Job, exit_code: int | None) -> Attempt:
    """What to say of an episode whose process died, each time it was run."""
    how = "" if exit_code is None else f" (exit status {exit_code})"
    if exit_code is not None and exit_code < 0:
        how = f" ({signal.Signals(-exit_code).name})"
    text = f"the process that ran it died{how}, and so did a second one"
    return failed(job, f"WorkerDied: {text}", text)


class _Worker(Closing):
    """One process that runs one job after another."""

    def __init__(self, context: multiprocessing.context.SpawnContext) -> None:
        self.pipe, theirs = context.Pipe()
        self.since_s = 0.0
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()  # so that the pipe ends when the process does

    @property
    def exit_code(self) -> int | None:
        return self._process.exitcode

    def close(self) -> None:
        self._process.kill()
        self._process.join()
        self.pipe.close()

    def give(self, job: Job) -> None:
        self.since_s = time.monotonic()
        with contextlib.suppress(OSError):  # it has died: taking its result will tell
            self.pipe.send(job)

    def take(self) -> Attempt | None:
        """The result, or None from a process that has died."""
        try:
            result: Attempt = self.pipe.recv()
        except Exception:  # the end of the pipe, or half an answer
            self._process.join(5.0)
            return None
        return result


def _serve(pipe: Connection) -> None:
    """Run what comes through the pipe, until its other end is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is interrupted, and ends this
    one_thread()
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send(attempt(pipe.recv()))
            tidy()


def tidy() -> None:
    """Give the system back what an episode has used; glibc alone keeps it, and it adds up.

    Only for processes that do nothing but episodes: what the first one has loaded is taken to stay.
    """
    gc.collect()
    if not gc.get_freeze_count():
        gc.freeze()  # looking through all modules again costs as much as half a simulated second
    with contextlib.suppress(AttributeError, OSError):  # another C library
        ctypes.CDLL(None).malloc_trim(0)


def one_thread() -> None:
    """Keep this process to one core, where its libraries can still be told."""
    import cv2  # noqa: PLC0415 - heavy, and only workers need this

    cv2.setNumThreads(1)


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes started meanwhile use one thread each."""
    before = {name: os.environ.get(name) for name in _THREAD_SETTINGS}
    os.environ.update(dict.fromkeys(_THREAD_SETTINGS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
