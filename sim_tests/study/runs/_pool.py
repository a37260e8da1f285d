"""Worker processes on this computer; the death of one costs at most the episode that it ran."""

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
from contextlib import AbstractContextManager
from multiprocessing.connection import Connection, wait
from typing import Final, cast

from ._episode import Attempt, attempt, failed
from ._job import Job

#: A job with its number in the run.
NumberedJob = tuple[int, Job]
#: Times that an episode is run again after its process has died.
RETRIES: Final = 1

# Settings of libraries that would use every core for one episode.
_THREAD_SETTINGS: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


def run_here(jobs: Sequence[NumberedJob]) -> Iterator[tuple[int, Attempt]]:
    """Run jobs one after another in this process."""
    for number, job in jobs:
        yield number, attempt(job)


def run_in_processes(
    jobs: Sequence[NumberedJob], workers: int, time_limit_s: float | None = None
) -> Iterator[tuple[int, Attempt]]:
    """Run jobs in a new :class:`WorkerPool`, and yield each result as soon as it is there.

    Args:
        jobs: the jobs with their numbers.
        workers: number of processes, ≥ 1.
        time_limit_s: as in :class:`WorkerPool`.
    """
    with WorkerPool(min(workers, len(jobs)), time_limit_s) as pool:
        yield from pool.run(jobs)


class WorkerPool(AbstractContextManager["WorkerPool"]):
    """Worker processes that run several batches of jobs.

    An episode whose process dies (killed, out of memory, a crash in compiled code) is run once
    more. If that process dies, too, the death is the episode's result.

    Args:
        workers: number of processes.
        time_limit_s: wall-clock limit of an episode, which is ended there and not run again; None
            for no limit.
    """

    def __init__(self, workers: int, time_limit_s: float | None = None) -> None:
        self._time_limit_s = time_limit_s
        # Not "fork": a forked process would share the physics.
        self._context = multiprocessing.get_context("spawn")
        with one_thread_each():
            self._idle = [_Worker(self._context) for _ in range(workers)]
        self._busy: dict[Connection, tuple[_Worker, int, Job, int]] = {}

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Kill the processes, even in the middle of an episode."""
        for worker in [*self._idle, *(each for each, *_ in self._busy.values())]:
            worker.close()
        self._idle, self._busy = [], {}

    def run(self, jobs: Sequence[NumberedJob]) -> Iterator[tuple[int, Attempt]]:
        """Run a batch of jobs, and yield each result as soon as it is there."""
        waiting = deque((number, job, 0) for number, job in jobs)
        idle, busy = self._idle, self._busy
        while waiting or busy:
            while waiting and idle:
                number, job, deaths = waiting.popleft()
                worker = idle.pop()
                busy[worker.pipe] = (worker, number, job, deaths)
                worker.send(job)
            ready = cast(
                list[Connection], wait(list(busy), None if self._time_limit_s is None else 1)
            )
            overdue = self._overdue(ready)
            for pipe in ready:
                worker, number, job, deaths = busy.pop(pipe)
                result = worker.receive()
                if result is not None:
                    idle.append(worker)
                    yield number, result
                    continue
                self._replace(worker)
                if deaths < RETRIES:
                    waiting.appendleft((number, job, deaths + 1))
                else:
                    yield number, _worker_died(job, worker.exit_code)
            for pipe in overdue:
                worker, number, job, _ = busy.pop(pipe)
                self._replace(worker)
                yield number, self._timed_out(job)

    def _replace(self, worker: _Worker) -> None:
        worker.close()
        with one_thread_each():
            self._idle.append(_Worker(self._context))

    def _overdue(self, ready: Sequence[Connection]) -> list[Connection]:
        """Return the pipes of the processes that are over the time limit without a result."""
        limit_s = self._time_limit_s
        if limit_s is None:
            return []
        latest_s = time.monotonic() - limit_s
        return [
            pipe
            for pipe, (worker, *_) in self._busy.items()
            if pipe not in ready and worker.since_s < latest_s
        ]

    def _timed_out(self, job: Job) -> Attempt:
        text = f"ended after the time limit of {self._time_limit_s:g} s"
        return failed(job, f"TimeLimit: {text}", text)


def _worker_died(job: Job, exit_code: int | None) -> Attempt:
    """Return the result of an episode whose process died each time."""
    how = "" if exit_code is None else f" (exit status {exit_code})"
    if exit_code is not None and exit_code < 0:  # killed by a signal, not on Windows
        how = f" ({signal.Signals(-exit_code).name})"
    text = f"the process that ran it died{how}, and so did a second one"
    return failed(job, f"WorkerDied: {text}", text)


class _Worker:
    """One process that runs one job after another."""

    def __init__(self, context: multiprocessing.context.SpawnContext) -> None:
        self.pipe, theirs = context.Pipe()
        self.since_s = 0.0
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()  # the pipe then ends with the process

    @property
    def exit_code(self) -> int | None:
        return self._process.exitcode

    def close(self) -> None:
        self._process.kill()
        self._process.join()
        self.pipe.close()

    def send(self, job: Job) -> None:
        self.since_s = time.monotonic()
        with contextlib.suppress(OSError):  # a dead process: receive() returns None
            self.pipe.send(job)

    def receive(self) -> Attempt | None:
        """Return the result, or None from a process that has died."""
        try:
            result: Attempt = self.pipe.recv()
        except Exception:  # the end of the pipe, or an incomplete result
            self._process.join(5.0)
            return None
        return result


def _serve(pipe: Connection) -> None:
    """Run the jobs that come through the pipe, until its other end is closed."""
    signal.signal(
        signal.SIGINT, signal.SIG_IGN
    )  # the parent handles an interrupt and ends this process
    one_thread()
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send(attempt(pipe.recv()))
            tidy()


def tidy() -> None:
    """Return the memory of an episode to the system; glibc would keep it, and it adds up.

    Only for processes that run nothing but episodes: the objects of the first one are frozen.
    """
    gc.collect()
    if not gc.get_freeze_count():
        gc.freeze()  # scanning all modules each time costs as much as half a simulated second
    with contextlib.suppress(AttributeError, OSError, TypeError):  # not glibc
        ctypes.CDLL(None).malloc_trim(0)


def one_thread() -> None:
    """Limit the libraries of this process to one thread, as far as they still allow it."""
    import cv2  # noqa: PLC0415 - heavy, and only workers need this

    cv2.setNumThreads(1)


@contextlib.contextmanager
def one_thread_each() -> Iterator[None]:
    """Let processes that are started in the block use one thread each."""
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
