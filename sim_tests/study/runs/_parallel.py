"""Parallel work in this process, in processes of this computer, or on a Dask cluster."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import logging
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager
from typing import Any, Final, TypeVar

from joblib.externals.loky import get_reusable_executor

from perception.arrays import finite_number

from ...world.errors import SimError, needs

Item = TypeVar("Item")
Result = TypeVar("Result")

# Settings of libraries that would use every core for one item.
_ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS"), "1"
)
# Idle processes end after this time, so that they do not stay behind a process that was killed.
_IDLE_S: Final = 10
# The address that stands for a cluster on this computer.
_LOCAL: Final = "local"
# Items per thread that a cluster has at a time: its workers never wait, and a million items are
# never in the memory of its scheduler at once.
_AHEAD: Final = 4
_CONNECT_S: Final = 20.0
# Dask samples a profile a hundred times per second for its dashboard, and returns memory at every
# step. Both make episodes a fifth slower. There is no dashboard, and tidy() returns the memory.
_LEAN: Final = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
}
# A physics world belongs to one thread at a time, even in a worker with several threads.
_one_at_a_time = threading.Lock()


class Workers(AbstractContextManager["Workers"]):
    """This process, processes of this computer, or a Dask cluster; they last until the block ends.

    When a process dies (killed, out of memory, a crash in compiled code), every item that it may
    have worked on runs again, each alone. An item that then kills two processes is given up.

    Args:
        workers: number of processes; 1 works in this process, None takes one per core.
        scheduler: address of a Dask scheduler (``"tcp://…"``), or ``"local"`` for a cluster of
            ``workers`` processes on this computer; None works without Dask.
        own_process: a single worker has a process of its own, too.
        most: no more processes than this, such as the number of items; None for no bound.
    """

    def __init__(
        self,
        workers: int | None = None,
        *,
        scheduler: str | None = None,
        own_process: bool = False,
        most: int | None = None,
    ) -> None:
        count = (
            cores() if workers is None else finite_number("workers", workers, SimError, minimum=1)
        )
        self._count = int(count)
        #: Whether all work is done in this process.
        self.is_this_process = scheduler is None and self._count == 1 and not own_process
        if most is not None:
            self._count = max(min(self._count, most), 1)
        self._scheduler = scheduler
        self._cleanup = contextlib.ExitStack()
        self._client: Any = None
        self._has_processes = False

    def __exit__(self, *_: object) -> None:
        self._cleanup.close()

    def results(
        self,
        function: Callable[[Item], Result],
        items: Iterable[Item],
        *,
        on_death: Callable[[Item, str], Result] | None = None,
    ) -> Generator[tuple[int, Result], None, None]:
        """Yield the number of each item and the function's result for it, as soon as it is there.

        Args:
            function: of a module, so that other processes can import it. An exception that it
                raises ends the work.
            items: can be pickled.
            on_death: returns the result of an item that kills its process, given the item and the
                reason; without it, such an item ends the work.

        Raises:
            SimError: no Dask, no scheduler at the address, or a process that died twice.
        """
        numbered = deque(enumerate(items))
        if self.is_this_process:
            yield from ((number, function(item)) for number, item in numbered)
        elif numbered and self._scheduler is None:
            # The next item of each process waits for it, so that no process waits for this one.
            if not self._has_processes:
                self._has_processes = True
                self._cleanup.callback(end_processes)
            yield from _on(
                lambda: _processes(self._count),
                lambda: 2 * self._count,
                function,
                numbered,
                on_death,
            )
        elif numbered and self._scheduler is not None:
            if self._client is None:
                cluster = _cluster(self._scheduler, self._count)
                self._client = self._cleanup.enter_context(cluster)
            executor = self._client.get_executor(pure=False)

            def ahead() -> int:  # workers may join and leave at any time
                return _AHEAD * max(sum(map(int, self._client.nthreads().values())), 1)

            yield from _on(lambda: executor, ahead, function, numbered, on_death)


def in_parallel(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    workers: int | None = None,
    own_process: bool = False,
    on_death: Callable[[Item, str], Result] | None = None,
) -> Generator[tuple[int, Result], None, None]:
    """Yield the results of :meth:`Workers.results`, with workers for these items alone."""
    with Workers(workers, own_process=own_process, most=len(items)) as some:
        yield from some.results(function, items, on_death=on_death)


def cores() -> int:
    """Return the number of cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # pragma: no cover - macOS and Windows
        return os.cpu_count() or 1


def end_processes() -> None:
    """Kill the processes of :class:`Workers`, even in the middle of an item."""
    get_reusable_executor(reuse=True).shutdown(kill_workers=True)


def _on(
    executor: Callable[[], Executor],
    ahead: Callable[[], int],
    function: Callable[[Item], Result],
    waiting: deque[tuple[int, Item]],
    on_death: Callable[[Item, str], Result] | None,
) -> Iterator[tuple[int, Result]]:
    """Work with an executor, which is asked for anew after a death.

    It has at most ``ahead()`` items at a time: those in it when a process dies are the suspects.
    """
    sent: dict[Future[Result], tuple[int, Item]] = {}
    suspects: list[tuple[int, Item]] = []
    while waiting or sent or suspects:
        while waiting and len(sent) < ahead() and not suspects:
            number, item = waiting.popleft()
            try:
                sent[executor().submit(_work, function, item)] = number, item
            except BrokenProcessPool:  # a process died since the last result
                suspects.append((number, item))
        finished = wait(sent, return_when=FIRST_COMPLETED).done
        results = []
        for future in finished:
            number, item = sent.pop(future)
            if _is_death(future.exception()):
                suspects.append((number, item))
            else:
                results.append((number, future.result()))
        yield from results
        if suspects and not sent:
            for number, item in suspects:
                yield number, _alone(executor, function, item, on_death)
            suspects = []


def _alone(
    executor: Callable[[], Executor],
    function: Callable[[Item], Result],
    item: Item,
    on_death: Callable[[Item, str], Result] | None,
) -> Result:
    """Return the result of an item while no other is worked on, in a second process if need be."""
    for _ in range(2):
        future = executor().submit(_work, function, item)
        error = future.exception()
        if not _is_death(error):
            return future.result()
    reason = f"the process that ran it died, and so did a second one ({type(error).__name__})"
    if on_death is None:
        raise SimError(f"{reason}: {item!r:.200}") from error
    return on_death(item, reason)


def _is_death(error: BaseException | None) -> bool:
    """Return True for the error of a process that died: loky's, or Dask's ``KilledWorker``."""
    return isinstance(error, BrokenProcessPool) or type(error).__name__ == "KilledWorker"


def _processes(count: int) -> Executor:
    """Return the processes of this computer: those that run, or new ones after a death."""
    # Processes that were started in other surroundings are not used again.
    surroundings = {**os.environ, **_ONE_THREAD}
    executor: Executor = get_reusable_executor(
        count, timeout=_IDLE_S, initializer=gc.disable, env=surroundings
    )
    return executor


@contextlib.contextmanager
def _cluster(scheduler: str, workers: int) -> Iterator[Any]:
    """Yield a client of a Dask cluster; raise SimError if no scheduler answers."""
    with needs("a scheduler", "Dask"):
        import dask  # noqa: PLC0415 - an optional dependency
        from distributed import Client, LocalCluster  # noqa: PLC0415
    with contextlib.ExitStack() as cleanup:  # runs in the opposite order
        address: Any = scheduler
        try:
            if scheduler == _LOCAL:
                with dask.config.set(_LEAN):
                    address = LocalCluster(
                        n_workers=workers,
                        threads_per_worker=1,
                        processes=True,
                        dashboard_address=None,
                        # Even without a dashboard the scheduler serves its status, by default on
                        # a port that another cluster on this computer may have.
                        scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
                    )
                cleanup.callback(address.close)
            client = Client(address, timeout=_CONNECT_S)
        except (OSError, ValueError) as cause:
            raise SimError(
                f"no Dask scheduler answers at {scheduler!r}: {cause}; give tcp://HOST:PORT of one "
                "that runs, or 'local'"
            ) from cause
        cleanup.callback(client.close)
        if scheduler == _LOCAL:
            cleanup.callback(_silence, client)
            client.run(gc.disable)
        yield client


def _silence(client: Any) -> None:
    """Turn off the log of the workers of a local cluster.

    While the cluster closes, their heartbeats may not reach the scheduler, and they would log it.
    """
    with contextlib.suppress(OSError):  # the scheduler has ended already
        client.run(logging.disable, logging.CRITICAL, on_error="ignore")


def _work(function: Callable[[Item], Result], item: Item) -> Result:
    """Work on one item in a process that does nothing else.

    A new process collects no garbage until it has imported the function: searching all modules for
    it again and again takes a sixth of the time that a process needs to start.
    """
    import cv2  # noqa: PLC0415 - heavy, and only workers need this

    if not gc.isenabled():
        gc.freeze()
        gc.enable()
    if threading.current_thread() is threading.main_thread():
        # The process that waits for the result handles an interrupt, and ends this one.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)
    with _one_at_a_time:
        result = function(item)
        tidy()
    return result


def tidy() -> None:
    """Return the memory of an episode to the system; glibc would keep it, and it adds up.

    Only for processes that run nothing but episodes: the objects of the first one are frozen.
    """
    gc.collect()
    if not gc.get_freeze_count():
        gc.freeze()  # scanning all modules each time costs as much as half a simulated second
    with contextlib.suppress(AttributeError, OSError, TypeError):  # not glibc
        ctypes.CDLL(None).malloc_trim(0)
