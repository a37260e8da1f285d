"""Many episodes into the folder of a run, which can be resumed; the table is always the same."""

from __future__ import annotations

import contextlib
import json
import signal
import sys
import threading
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Final

import filelock
from tqdm import tqdm

from awarenav.errors import counted
from awarenav.files import write_text
from perception.arrays import finite_number
from perception.documents import parse_yaml

from ...crossing.planner import is_outside
from ...world.bullet import require_pybullet
from ...world.errors import SimError
from ..measures import EpisodeRecord, write_records
from ._episode import attempt, died, failed, free_run_or_none, people_in, task_of
from ._parallel import Workers
from ._run_files import (
    JOB_FIELDS,
    Attempt,
    Job,
    RunFiles,
    not_of_this_run,
    read_attempts,
    read_jobs,
    read_run,
    versions,
)

# An episode with its task without people, where another episode has that in common.
_Item = tuple[Job, EpisodeRecord | None]

_OTHER_WAY: Final = (
    "resume with the arguments that began it, which run.json holds, or run into another folder"
)


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
    limit_s = None
    if time_limit_s is not None:
        limit_s = finite_number("time_limit_s", time_limit_s, SimError, minimum=1.0)
        if scheduler is not None:
            raise SimError("a time limit works in processes of this computer, not on a cluster")
    if any(is_outside(job.planner_text) for job in jobs):
        if scheduler is not None or workers not in (None, 1):
            raise SimError(
                "a stack outside drives one robot, so that its episodes run one after the other: "
                "give 1 worker and no scheduler"
            )
        workers = 1
    needed = versions()
    if scheduler is None:
        require_pybullet()
    folder = RunFolder(
        Path(out_dir),
        jobs,
        {"versions": needed, **(about or {})},
        resume=resume,
        overwrite=overwrite,
    )
    with folder, terminated_as_interrupted():
        remaining = [number for number in range(len(jobs)) if number not in folder.done]
        some = Workers(
            workers, scheduler=scheduler, own_process=limit_s is not None, most=len(remaining)
        )
        if not some.is_this_process:  # the long ones first: none is left to one process at the end
            remaining.sort(key=lambda number: people_in(jobs[number]), reverse=True)
        bar = tqdm(
            total=len(jobs),
            initial=len(folder.done),
            desc="crossings",
            unit="episode",
            smoothing=0.05,
            file=sys.stderr,
            disable=not progress,
        )
        try:
            with bar, some:
                items = _with_free_runs([jobs[number] for number in remaining], some, limit_s)
                function = partial(_attempted, needed if scheduler is not None else {}, limit_s)
                for place, outcome in some.results(function, items, on_death=_died):
                    folder.add(remaining[place], outcome)
                    bar.update()
        except BaseException:
            with contextlib.suppress(SimError):  # the first error says more
                folder.write_tables()
            raise
        return folder.write_tables()


def _with_free_runs(jobs: Sequence[Job], some: Workers, limit_s: float | None) -> list[_Item]:
    """Return the jobs with the tasks without people that several of them have in common.

    Each is driven once. In a single process, the first episode of a task drives it and the others
    find it in the memory.
    """
    if some.is_this_process:
        return [(job, None) for job in jobs]
    tasks = [task_of(job) for job in jobs]
    counts = Counter(tasks)
    shared = {task: job for job, task in zip(jobs, tasks, strict=True) if counts[task] > 1}
    found: dict[Any, EpisodeRecord | None] = {}
    names = list(shared)
    drive_free = partial(free_run_or_none, limit_s=limit_s)
    for place, free in some.results(drive_free, shared.values(), on_death=_no_free_run):
        found[names[place]] = free
    return [(job, found.get(task)) for job, task in zip(jobs, tasks, strict=True)]


def _no_free_run(job: Job, reason: str) -> EpisodeRecord | None:
    return None


def _attempted(needed: Mapping[str, str], limit_s: float | None, item: _Item) -> Attempt:
    """Run one episode; on a worker of a cluster refuse it if a version that is needed differs."""
    own = versions() if needed else {}
    for name, version in needed.items():
        if own.get(name) != version:
            text = f"a worker has {name} {own.get(name)}, and the run was begun with {version}"
            return failed(item[0], f"SimError: {text}", text)
    return attempt(*item, limit_s=limit_s)


def _died(item: _Item, reason: str) -> Attempt:
    return died(item[0], reason)


def held(folder: Path) -> filelock.BaseFileLock:
    """Return the lock of a folder, which this process holds until it releases it or dies.

    The folder is made when missing. Any thread of this process may release the lock.

    Raises:
        SimError: another process holds it, or the folder cannot be written.
    """
    lock = filelock.FileLock(folder / ".lock", thread_local=False)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock.acquire(blocking=False)
    except filelock.Timeout as cause:
        raise SimError(f"another process works in {folder}") from cause
    except OSError as cause:
        raise SimError(f"cannot write into {folder}: {cause.strerror or cause}") from cause
    return lock


@contextlib.contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Let SIGTERM interrupt the block as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


class RunFolder(AbstractContextManager["RunFolder"]):
    """The folder of a run, open for writing.

    The file of an episode appears whole when the episode has ended, so a process that is killed at
    any moment leaves whole files alone. Resuming runs the episodes that have none.

    Attributes:
        done: outcomes of the episodes that have ended, by the number of their job.

    Raises:
        SimError: the folder cannot be written; another process runs into it; it holds another run
            than this (with ``resume``); or it holds a run, finished or not, or another program's
            ``episodes.csv`` (with neither ``resume`` nor ``overwrite``).
    """

    def __init__(
        self,
        path: Path,
        jobs: Sequence[Job],
        about: Mapping[str, Any],
        *,
        resume: bool = False,
        overwrite: bool = False,
    ) -> None:
        self._files = RunFiles(path)
        self._jobs = jobs
        self._about = about
        self.done: dict[int, Attempt] = {}
        self._lock = held(path)
        try:
            if resume:
                self._refuse_another_run()
                self.done = self._own_attempts()
                self._write_run("running")
            else:
                if not overwrite:
                    self._refuse_occupied()
                self._write_run("running")
                self._start()
        except BaseException:
            self._lock.release()
            raise

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def add(self, number: int, attempt: Attempt) -> None:
        """Write the file of an episode."""
        content = asdict(attempt)
        del content["number"]  # the name of the file
        text = json.dumps(content, ensure_ascii=False) + "\n"
        write_text(self._files.episode(number), text, SimError)
        self.done[number] = attempt

    def write_tables(self) -> tuple[EpisodeRecord, ...]:
        """Write the tables of the episodes that have ended; return their records.

        Both are in the order of the jobs. The run is complete if no job is left.
        """
        ended = sorted(self.done.items())
        records = tuple(attempt.record for _, attempt in ended)
        write_records(self._files.episodes, records)
        self._files.errors.unlink(missing_ok=True)
        log = "".join(
            f"== episode {number}: {each.record.conditions.text}\n{each.traceback.rstrip()}\n\n"
            for number, each in ended
            if each.traceback
        )
        if log:
            write_text(self._files.errors, log, SimError)
        if len(ended) == len(self._jobs):
            try:
                write_records(self._files.parquet, records)
            except SimError:  # without pyarrow there is no Parquet, and the table is complete
                self._files.parquet.unlink(missing_ok=True)
            self._write_run("complete")
        return records

    def _refuse_occupied(self) -> None:
        """Refuse a finished run, an unfinished one with episodes, and another program's table."""
        files, about = self._files, read_run(self._files.folder)
        total = about.get("episodes", "?")
        done = len(list(files.ended.glob("*.json")))
        if about.get("state") == "running" and done > 0:
            raise SimError(
                f"{files.folder} holds an unfinished run, with {done} of {total} episodes done: "
                "go on with --resume, replace it with --overwrite, or choose another --out"
            )
        if about.get("state") == "complete":
            episodes = counted(total, "episode") if isinstance(total, int) else f"{total} episodes"
            raise SimError(
                f"{files.folder} holds a finished run of {episodes}: replace it with --overwrite, "
                "choose another --out, or read its table again with --resume"
            )
        if about.get("state") != "running" and done > 0:
            raise SimError(
                f"{files.folder} holds {counted(done, 'episode')} of a run whose {files.run.name} "
                "cannot be read: choose another --out, or replace them with --overwrite"
            )
        if about.get("state") != "running" and files.episodes.exists():
            raise SimError(
                f"{files.folder} holds a table {files.episodes.name} that is not of a run: there "
                f"is no {files.run.name} beside it; choose another --out, or replace it with "
                "--overwrite"
            )

    def _start(self) -> None:
        files = self._files
        # The old episodes go first, so that they are never taken for those of the new jobs.
        old = sorted(files.ended.glob("*.json"))
        for path in (*old, files.episodes, files.parquet, files.social, files.errors):
            path.unlink(missing_ok=True)
        lines = (json.dumps(asdict(job), ensure_ascii=False) + "\n" for job in self._jobs)
        write_text(files.jobs, "".join(lines), SimError)

    def _own_attempts(self) -> dict[int, Attempt]:
        """Return the outcomes in the folder; refuse a file of another episode by its name."""
        found = read_attempts(self._files.folder)
        for number, each in found.items():
            key = each.record.conditions
            if number >= len(self._jobs) or key != self._jobs[number].conditions:
                raise not_of_this_run(self._files.episode(number), f"it is {key.text}")
        return found

    def _refuse_another_run(self) -> None:
        """Raise SimError, saying what differs, unless the folder holds this run."""
        folder = self._files.folder
        if not self._files.jobs.exists():
            raise SimError(
                f"{folder} holds no run to resume: there is no {self._files.jobs.name} in it"
            )
        before = read_run(folder)
        old_versions = before.get("versions", {})
        for name, version in self._about.get("versions", {}).items():
            if old_versions.get(name, version) != version:
                raise SimError(
                    f"the run in {folder} was begun with {name} {old_versions[name]}, and this is "
                    f"{version}: their results do not belong into one table; run into another "
                    "folder"
                )
        old, new = before.get("settings", {}), self._about.get("settings", {})
        for name in {**old, **new} if old and new else ():
            if old.get(name) != new.get(name):
                raise SimError(
                    f"the run in {folder} was begun with {name} {old.get(name)!r}, and this has "
                    f"{new.get(name)!r}: {_OTHER_WAY}"
                )
        old_jobs = read_jobs(folder)
        if len(old_jobs) != len(self._jobs):
            raise SimError(
                f"the run in {folder} has {counted(len(old_jobs), 'episode')}, and "
                f"{len(self._jobs)} were asked for: {_OTHER_WAY}"
            )
        for number, (was, job) in enumerate(zip(old_jobs, self._jobs, strict=True)):
            if was != job:
                _refuse_other_job(folder, number, was, job)

    def _write_run(self, state: str) -> None:
        content = {"state": state, "episodes": len(self._jobs), **self._about}
        text = json.dumps(content, indent=2, ensure_ascii=False)
        write_text(self._files.run, text + "\n", SimError)


def _refuse_other_job(folder: Path, number: int, was: Job, job: Job) -> None:
    """Raise SimError, naming the first field in which an episode of the folder differs."""
    before, now = asdict(was), asdict(job)
    name = next(each for each in JOB_FIELDS if before[each] != now[each])
    values = f" ({before[name]!r}, now {now[name]!r})"
    if "\n" in f"{before[name]}{now[name]}":
        values = f" ({_difference(before[name], now[name])})"
    raise SimError(
        f"the run in {folder} has other episodes than these: episode {number} has another "
        f"{name}{values}; {_OTHER_WAY}"
    )


def _difference(before: str, now: str) -> str:
    """Return the dotted key of the first difference between two texts of YAML."""
    old, new = (parse_yaml(text, "it", SimError) for text in (before, now))
    path: list[str] = []
    while isinstance(old, dict) and isinstance(new, dict):
        key = next(key for key in {**old, **new} if old.get(key) != new.get(key))
        path.append(str(key))
        old, new = old.get(key), new.get(key)
    return ".".join(path)
