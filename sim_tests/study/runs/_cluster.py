"""Episodes on a Dask cluster whose workers join and leave; the only module that imports Dask."""

from __future__ import annotations

import contextlib
import itertools
import logging
import threading
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final
from uuid import uuid4

from perception.installation import install_command

from ...world.errors import SimError
from ._episode import Attempt, attempt, failed
from ._job import Job
from ._job import versions as own_versions
from ._pool import RETRIES, NumberedJob, one_thread, tidy

try:
    import dask
    from distributed import Client, LocalCluster, as_completed
    from distributed.scheduler import KilledWorker
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "a scheduler needs Dask, which is not installed; it is part of the extra 'bench': "
        + install_command("bench")
    ) from cause

# The address that stands for a cluster on this computer.
_LOCAL: Final = "local"
# Episodes per thread that the scheduler has at a time: workers never wait, and a million episodes
# are never in its memory at once.
_AHEAD: Final = 4
_CONNECT_S: Final = 20.0
# Dask samples a profile a hundred times per second for its dashboard, and returns memory at every
# step. Both make episodes a fifth slower. There is no dashboard, and tidy() returns the memory.
_LEAN: Final = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
}

# Even without a dashboard the scheduler serves its status by HTTP, by default on port 8787, which
# another cluster on this computer may have.
_FREE_PORT: Final = {"dashboard_address": "127.0.0.1:0"}

# A physics world belongs to one thread at a time, even in a worker with several threads.
_one_at_a_time = threading.Lock()


def run_on_cluster(
    jobs: Sequence[NumberedJob], scheduler: str, workers: int, versions: Mapping[str, str]
) -> Iterator[tuple[int, Attempt]]:
    """Run jobs on a Dask cluster, and yield each result as soon as it is there.

    Workers may join and leave at any time. The episode of a worker that died runs on another one,
    as often as the scheduler's ``allowed-failures`` says, and then once more.

    Args:
        jobs: the jobs with their numbers.
        scheduler: address, or ``"local"`` for ``workers`` processes on this computer.
        workers: number of processes of the local cluster.
        versions: versions that every worker must have.

    Raises:
        SimError: no scheduler answers at the address.
    """
    if not jobs:
        return
    cluster = None
    try:
        if scheduler == _LOCAL:
            with dask.config.set(_LEAN):
                cluster = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,
                    scheduler_kwargs=_FREE_PORT,
                )
        client = Client(cluster if cluster is not None else scheduler, timeout=_CONNECT_S)
    except (OSError, ValueError, ImportError) as cause:
        raise SimError(
            f"no Dask scheduler answers at {scheduler!r}: {cause}; give tcp://HOST:PORT of one "
            "that runs, or 'local'"
        ) from cause
    with contextlib.ExitStack() as cleanup:  # runs in the opposite order
        if cluster is not None:
            cleanup.callback(cluster.close)
        cleanup.callback(client.close)
        if cluster is not None:
            cleanup.callback(_silence, client)
        yield from _run(client, jobs, dict(versions))


def _silence(client: Any) -> None:
    """Turn off the log of the workers of a local cluster.

    While the cluster closes, their heartbeats may not reach the scheduler, and they would log it.
    """
    with contextlib.suppress(OSError):  # the scheduler has ended already
        client.run(logging.disable, logging.CRITICAL, on_error="ignore")


def _run(
    client: Any, jobs: Sequence[NumberedJob], versions: dict[str, str]
) -> Iterator[tuple[int, Attempt]]:
    run = uuid4().hex  # makes the names of the tasks unique on the cluster
    task_numbers = itertools.count()
    waiting = deque((number, job, 0) for number, job in jobs)
    sent: dict[Any, tuple[int, Job, int]] = {}
    finished = as_completed(raise_errors=False)

    def send() -> None:
        ahead = _AHEAD * max(sum(client.nthreads().values()), 1)
        while waiting and len(sent) < ahead:
            number, job, deaths = waiting.popleft()
            key = f"episode-{run}-{next(task_numbers)}"
            future = client.submit(_remote, job, versions, key=key, pure=False)
            sent[future] = (number, job, deaths)
            finished.add(future)

    send()
    for future in finished:
        number, job, deaths = sent.pop(future)
        error = future.exception()
        if error is None:
            result: Attempt = future.result()
            yield number, result
        elif isinstance(error, KilledWorker) and deaths < RETRIES:
            waiting.appendleft((number, job, deaths + 1))
        else:
            yield number, failed(job, f"{type(error).__name__}: {error}", str(error))
        future.release()
        send()


def _remote(job: Job, versions: dict[str, str]) -> Attempt:
    """Run one episode on a worker; refuse it there if a version differs."""
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
