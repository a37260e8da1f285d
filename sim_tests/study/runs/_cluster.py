"""The one place that imports Dask: episodes on a cluster whose workers come and go."""

from __future__ import annotations

import contextlib
import itertools
import logging
import threading
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final
from uuid import uuid4

from ...world.errors import SimError
from ._episode import Attempt, attempt, failed
from ._job import Job
from ._job import versions as own_versions
from ._pool import Numbered, one_thread, tidy

try:
    import dask
    from distributed import Client, LocalCluster, as_completed
    from distributed.scheduler import KilledWorker
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "a scheduler needs Dask, which is not installed; it is part of the extra 'bench': "
        "pip install 'awarenav[bench]'"
    ) from cause

#: An embedded cluster on this computer.
LOCAL: Final = "local"
# So many episodes a thread are with the scheduler at a time: it is never idle, and a million
# episodes are never in its memory at once.
_AHEAD: Final = 4
_DEATHS_ALLOWED: Final = 1
_CONNECT_S: Final = 20.0
# A profiler that looks in a hundred times a second for a dashboard that is not there, and memory
# handed back at every turn, which tidy() does once an episode, make episodes a fifth slower.
_LEAN: Final = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
}

# A physics world belongs to one thread at a time, whatever number a worker was started with.
_one_at_a_time = threading.Lock()


def run_on_cluster(
    jobs: Sequence[Numbered], scheduler: str, workers: int, versions: Mapping[str, str]
) -> Iterator[tuple[int, Attempt]]:
    """Run jobs on a Dask cluster, and give each result as soon as it is there.

    Workers may join and leave at any time. What one was at when it died runs elsewhere, as often as
    the scheduler's ``allowed-failures`` says, and then once more.

    Args:
        jobs: with their numbers.
        scheduler: address, or ``"local"`` for ``workers`` processes on this computer.
        workers: of the local cluster.
        versions: that workers must have, too.

    Raises:
        SimError: no scheduler answers there.
    """
    if not jobs:
        return
    cluster = None
    try:
        if scheduler == LOCAL:
            with dask.config.set(_LEAN):
                cluster = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,
                )
        client = Client(cluster if cluster is not None else scheduler, timeout=_CONNECT_S)
    except (OSError, ValueError, ImportError) as cause:
        raise SimError(
            f"no Dask scheduler answers at {scheduler!r}: {cause}; give tcp://HOST:PORT of one "
            "that runs, or 'local'"
        ) from cause
    with contextlib.ExitStack() as ending:  # in the opposite order
        if cluster is not None:
            ending.callback(cluster.close)
        ending.callback(client.close)
        if cluster is not None:
            ending.callback(_silence, client)
        yield from _run(client, jobs, dict(versions))


def _silence(client: Any) -> None:
    """Let the workers of a local cluster say no more.

    Their heartbeats may find the scheduler gone while all is closed, and report it in many lines.
    """
    with contextlib.suppress(OSError):  # a scheduler that has gone already
        client.run(logging.disable, logging.CRITICAL, on_error="ignore")


def _run(
    client: Any, jobs: Sequence[Numbered], versions: dict[str, str]
) -> Iterator[tuple[int, Attempt]]:
    run = uuid4().hex  # names of tasks: no cluster has seen them before
    names = itertools.count()
    waiting = deque((number, job, 0) for number, job in jobs)
    out: dict[Any, tuple[int, Job, int]] = {}
    finished = as_completed(raise_errors=False)

    def send() -> None:
        ahead = _AHEAD * max(sum(client.nthreads().values()), 1)
        while waiting and len(out) < ahead:
            number, job, deaths = waiting.popleft()
            key = f"episode-{run}-{next(names)}"
            future = client.submit(_remote, job, versions, key=key, pure=False)
            out[future] = (number, job, deaths)
            finished.add(future)

    send()
    for future in finished:
        number, job, deaths = out.pop(future)
        error = future.exception()
        if error is None:
            result: Attempt = future.result()
            yield number, result
        elif isinstance(error, KilledWorker) and deaths < _DEATHS_ALLOWED:
            waiting.appendleft((number, job, deaths + 1))
        else:
            yield number, failed(job, f"{type(error).__name__}: {error}", str(error))
        future.release()
        send()


def _remote(job: Job, versions: dict[str, str]) -> Attempt:
    """What a worker runs."""
    own = own_versions()
    for name, version in versions.items():
        if own.get(name) != version:
            text = f"a worker has {name} {own.get(name)}, and the run was begun with {version}"
            return failed(job, f"SimError: {text}", text)
    with _one_at_a_time:
        one_thread()
        result = attempt(job)
        tidy()
        return result
