"""The folder of a run as its writer keeps it, so that an interrupted run can be resumed."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from ...world.errors import SimError
from ..measures import RECORD_COLUMNS, EpisodeRecord, read_record_file, record_row, write_records
from ._job import Job
from ._plan import JobKey, describe, job_key
from ._process_lock import ProcessLock
from ._run_files import JOB_FIELDS, RunFiles, job_line, parse_job, read_run

# Windows opens files as text unless told otherwise; other systems have no such flag.
_BINARY: Final = getattr(os, "O_BINARY", 0)


class RunFolder(AbstractContextManager["RunFolder"]):
    """The folder of a run, open for writing; a row is in the file as soon as it is added.

    A row is written by one system call. A process that is killed at any moment therefore leaves
    whole rows and at most one unfinished row. Resuming cuts that row off and runs its episode
    again.

    Args:
        path: the folder, made when missing.
        jobs: all episodes of the run.
        about: content of ``run.json`` beside the state: versions, command, settings.
        resume: continue the run that the folder holds.
        overwrite: replace the run that the folder holds.

    Attributes:
        done: records of the episodes that are finished, by the number of their job.

    Raises:
        SimError: the folder cannot be written; another process runs into it; it holds other
            episodes than these (with ``resume``); or it holds a run, finished or not, or another
            program's ``episodes.csv`` (with neither ``resume`` nor ``overwrite``).
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
        self._keys = {job_key(job): number for number, job in enumerate(jobs)}
        self._about = dict(about)
        self._total = len(jobs)
        self._file = -1
        self._process_lock: ProcessLock | None = None
        self.done: dict[int, EpisodeRecord] = {}
        try:
            path.mkdir(parents=True, exist_ok=True)
            flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | _BINARY
            self._file = os.open(self._files.episodes, flags, 0o666)
            self._lock()
            if resume:
                self._check_plan(jobs)
                self._continue()
            else:
                if not overwrite:
                    self._refuse_occupied()
                self._start(jobs)
        except OSError as cause:
            self.close()
            raise SimError(f"cannot run into {path}: {cause.strerror or cause}") from cause
        except BaseException:
            self.close()
            raise

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the folder; every row is already in it."""
        self._close_table()
        if self._process_lock is not None:
            self._process_lock.close()
            self._process_lock = None

    def add(self, number: int, record: EpisodeRecord, traceback: str = "") -> None:
        """Write the row of a job, and the traceback of its error."""
        self.done[number] = record
        self._append(record_row(record))
        if traceback:
            head = f"== episode {number}: {describe(record_key(record))}\n"
            with self._files.errors.open("a", encoding="utf-8") as file:
                file.write(f"{head}{traceback.rstrip()}\n\n")

    def finish(self) -> tuple[EpisodeRecord, ...]:
        """Write the rows in the order of the jobs and mark the run as complete.

        Returns:
            Every record, in that order.
        """
        records = tuple(self.done[number] for number in range(self._total))
        self._close_table()  # Windows replaces no file that is open
        write_records(self._files.episodes, records)
        try:
            write_records(self._files.parquet, records)
        except SimError:  # without pyarrow there is no Parquet, and the table is complete
            self._files.parquet.unlink(missing_ok=True)
        self._write_run("complete")
        return records

    def _lock(self) -> None:
        self._process_lock = ProcessLock(self._files.lock, wait=False)
        if not self._process_lock.held:
            raise SimError(f"another process is running episodes into {self._files.folder}")

    def _close_table(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _refuse_occupied(self) -> None:
        """Refuse a finished run, an unfinished one with episodes, and another program's table."""
        folder, about = self._files.folder, read_run(self._files.folder)
        done = self._files.episodes.read_bytes().count(b"\n") - 1  # the header is no episode
        if about.get("state") == "running" and done > 0:
            raise SimError(
                f"{folder} holds an unfinished run, with {done} of {about.get('episodes', '?')} "
                "episodes done: go on with --resume (resume=True), replace it with --overwrite "
                "(overwrite=True), or choose another --out"
            )
        if about.get("state") == "complete":
            raise SimError(
                f"{folder} holds a finished run of {about.get('episodes', '?')} episodes: replace "
                "it with --overwrite (overwrite=True), choose another --out, or read its table "
                "again with --resume (resume=True)"
            )
        if about.get("state") != "running" and done >= 0:
            raise SimError(
                f"{folder} holds a table {self._files.episodes.name} that is not of a run: there "
                f"is no {self._files.run.name} beside it; choose another --out, or replace it "
                "with --overwrite (overwrite=True)"
            )

    def _start(self, jobs: Sequence[Job]) -> None:
        # The old table goes first, so that its rows can never be taken for those of the new jobs.
        os.ftruncate(self._file, 0)
        for path in (self._files.parquet, self._files.errors):
            path.unlink(missing_ok=True)
        self._write_run("running")
        _write_whole(self._files.jobs, (job_line(job) for job in jobs))
        self._append(RECORD_COLUMNS)

    def _check_plan(self, jobs: Sequence[Job]) -> None:
        path, folder = self._files.jobs, self._files.folder
        if not path.exists():
            raise SimError(f"{folder} holds no run to resume: there is no {path.name} in it")
        about = read_run(folder)
        for name, version in self._about.get("versions", {}).items():
            before = about.get("versions", {}).get(name, version)
            if before != version:
                raise SimError(
                    f"the run in {folder} was begun with {name} {before}, and this is {version}:"
                    " their results do not belong into one table; run into another folder"
                )
        before_count = 0
        with path.open(encoding="utf-8") as file:
            for number, line in enumerate(file):
                before_count += 1
                if number < len(jobs) and line != job_line(jobs[number]):
                    _refuse_other_plan(path, number, line, jobs[number])
        if before_count != len(jobs):
            raise SimError(
                f"the run in {folder} has {before_count} episodes, and {len(jobs)} were asked "
                "for: resume with the arguments that began it, which run.json holds, or run into "
                "another folder"
            )

    def _continue(self) -> None:
        path = self._files.episodes
        found = read_record_file(path)
        os.ftruncate(self._file, found.whole_bytes)
        if found.whole_bytes == 0:
            self._append(RECORD_COLUMNS)
        for record in found.records:
            number = self._keys.get(record_key(record))
            if number is None:
                raise SimError(
                    f"{path} holds an episode that {self._files.jobs.name} does not: "
                    f"{describe(record_key(record))}"
                )
            self.done[number] = record
        self._write_run("running")

    def _append(self, cells: Iterable[str]) -> None:
        line = io.StringIO()
        csv.writer(line, lineterminator="\n").writerow(cells)
        os.write(self._file, line.getvalue().encode())

    def _write_run(self, state: str) -> None:
        content = {"state": state, "episodes": self._total, **self._about}
        text = json.dumps(content, indent=2, ensure_ascii=False)
        _write_whole(self._files.run, [text + "\n"])


def record_key(record: EpisodeRecord) -> JobKey:
    """Return the key of a record, which is unique in its run."""
    return JobKey(
        record.scenario,
        record.seed,
        record.policy,
        record.planner,
        record.perception,
        record.fault,
    )


def _refuse_other_plan(path: Path, number: int, line: str, job: Job) -> None:
    """Raise SimError, naming the first field in which a line of ``path`` differs from a job."""
    before, now = asdict(parse_job(line, f"{path}, line {number + 1}")), asdict(job)
    name = next(each for each in JOB_FIELDS if before[each] != now[each])
    values = ""
    if "\n" not in f"{before[name]}{now[name]}":
        values = f" ({before[name]!r}, now {now[name]!r})"
    raise SimError(
        f"the run in {path.parent} has other episodes than these: episode {number} has another "
        f"{name}{values}; resume with the arguments that began it, which run.json holds, or run "
        "into another folder"
    )


def _write_whole(path: Path, lines: Iterable[str]) -> None:
    """Write a file that appears whole or not at all."""
    partial = path.with_name(path.name + ".part")
    with partial.open("w", encoding="utf-8") as file:
        file.writelines(lines)
    partial.replace(path)
