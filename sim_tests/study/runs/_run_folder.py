"""The folder of a run as its writer keeps it, so that an interrupted run can be resumed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import filelock

from awarenav.errors import counted
from awarenav.files import write_text

from ...world.errors import SimError
from ..measures import EpisodeRecord, write_records
from ._job import JOB_FIELDS, Attempt, Job, describe, record_key
from ._plan import job_key
from ._run_files import RunFiles, not_of_this_run, read_attempts, read_jobs, read_run

_OTHER_WAY: Final = (
    "resume with the arguments that began it, which run.json holds, or run into another folder"
)


class RunFolder(AbstractContextManager["RunFolder"]):
    """The folder of a run, open for writing.

    The file of an episode appears whole when the episode has ended, so a process that is killed at
    any moment leaves whole files alone. Resuming runs the episodes that have none.

    Args:
        path: the folder, made when missing.
        jobs: all episodes of the run.
        about: content of ``run.json`` beside the state: versions, command, settings.
        resume: continue the run that the folder holds.
        overwrite: replace the run that the folder holds.

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
        try:
            path.mkdir(parents=True, exist_ok=True)
            # Any thread of this process may release the lock; a process that dies releases it.
            self._lock = filelock.FileLock(self._files.lock, thread_local=False)
            self._lock.acquire(blocking=False)
        except filelock.Timeout as cause:
            raise SimError(f"another process is running episodes into {path}") from cause
        except OSError as cause:
            raise SimError(f"cannot run into {path}: {cause.strerror or cause}") from cause
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
        text = json.dumps(asdict(attempt), ensure_ascii=False) + "\n"
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
            f"== episode {number}: {describe(record_key(attempt.record))}\n"
            f"{attempt.traceback.rstrip()}\n\n"
            for number, attempt in ended
            if attempt.traceback
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
        for number, attempt in found.items():
            key = record_key(attempt.record)
            if number >= len(self._jobs) or key != job_key(self._jobs[number]):
                raise not_of_this_run(self._files.episode(number), f"it is {describe(key)}")
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
    values = ""
    if "\n" not in f"{before[name]}{now[name]}":
        values = f" ({before[name]!r}, now {now[name]!r})"
    raise SimError(
        f"the run in {folder} has other episodes than these: episode {number} has another "
        f"{name}{values}; {_OTHER_WAY}"
    )
