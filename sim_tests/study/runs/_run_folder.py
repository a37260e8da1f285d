"""The folder of a run: what was planned, what is done, and how to go on after an interruption."""

from __future__ import annotations

import csv
import fcntl
import io
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, Final

from awarenav.closing import Closing

from ...world.errors import SimError
from ..measures import RECORD_COLUMNS, EpisodeRecord, read_record_file, record_row, write_records
from ._job import Job
from ._plan import JobKey, describe, job_key

JOBS: Final = "jobs.jsonl"
EPISODES: Final = "episodes.csv"
PARQUET: Final = "episodes.parquet"
RUN: Final = "run.json"
ERRORS: Final = "errors.log"
_FIELDS: Final = tuple(field.name for field in fields(Job))


class RunFolder(Closing):
    """Opens a folder to run jobs into; rows are in the file as soon as they are added.

    A row is written by one system call, so that a process killed at any moment leaves whole rows
    and at most one unfinished, which resuming cuts off and runs again.

    Args:
        path: of the folder, made when missing.
        jobs: all episodes of the run.
        about: what ``run.json`` says beside the state: versions, command, settings.
        resume: go on with the run that the folder holds.
        afresh: replace an unfinished run.

    Attributes:
        done: the records of an earlier part of this run, by the number of their job.

    Raises:
        SimError: the folder cannot be written, another process runs into it, it holds other
            episodes than these (when resuming), or an unfinished run (when neither resuming nor
            beginning afresh).
    """

    def __init__(
        self,
        path: Path,
        jobs: Sequence[Job],
        about: Mapping[str, Any],
        *,
        resume: bool = False,
        afresh: bool = False,
    ) -> None:
        self.path = path
        self._keys = {job_key(job): number for number, job in enumerate(jobs)}
        self._about = dict(about)
        self._total = len(jobs)
        self._file = -1
        self.done: dict[int, EpisodeRecord] = {}
        try:
            path.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path / EPISODES, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
            self._lock()
            if resume:
                self._check_plan(jobs)
                self._take_up()
            else:
                if not afresh:
                    self._refuse_unfinished()
                self._begin(jobs)
        except OSError as cause:
            self.close()
            raise SimError(f"cannot run into {path}: {cause.strerror or cause}") from cause
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Give the folder free; every row is already in it."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def add(self, number: int, record: EpisodeRecord, trace: str = "") -> None:
        """Write the row of a job, and the traceback of what went wrong."""
        self.done[number] = record
        self._append(_line(record_row(record)))
        if trace:
            head = f"== episode {number}: {_words(record)}\n"
            with (self.path / ERRORS).open("a", encoding="utf-8") as file:
                file.write(f"{head}{trace.rstrip()}\n\n")

    def finish(self) -> tuple[EpisodeRecord, ...]:
        """Put the rows in the order of the jobs and say that the run is complete.

        Returns:
            Every record, in that order.
        """
        records = tuple(self.done[number] for number in range(self._total))
        write_records(self.path / EPISODES, records)
        try:
            write_records(self.path / PARQUET, records)
        except SimError:  # without pyarrow there is no Parquet, and the table is complete
            (self.path / PARQUET).unlink(missing_ok=True)
        self._say("complete")
        return records

    def _lock(self) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as cause:
            raise SimError(f"another process is running episodes into {self.path}") from cause

    def _refuse_unfinished(self) -> None:
        about = read_run(self.path)
        if about.get("state") == "running":
            there = read_record_file(self.path / EPISODES).records
            if there:
                raise SimError(
                    f"{self.path} holds an unfinished run, with {len(there)} of "
                    f"{about.get('episodes', '?')} episodes done: go on with --resume "
                    "(resume=True), or choose another folder or delete this one"
                )

    def _begin(self, jobs: Sequence[Job]) -> None:
        # The old table goes first: no moment at which it could pass for one of the new jobs.
        os.ftruncate(self._file, 0)
        for name in (PARQUET, ERRORS):
            (self.path / name).unlink(missing_ok=True)
        self._say("running")
        _write_whole(self.path / JOBS, (job_line(job) for job in jobs))
        self._append(_line(RECORD_COLUMNS))

    def _check_plan(self, jobs: Sequence[Job]) -> None:
        path = self.path / JOBS
        if not path.exists():
            raise SimError(f"{self.path} holds no run to resume: there is no {JOBS} in it")
        about = read_run(self.path)
        for name, version in self._about.get("versions", {}).items():
            before = about.get("versions", {}).get(name, version)
            if before != version:
                raise SimError(
                    f"the run in {self.path} was begun with {name} {before}, and this is {version}:"
                    " their results do not belong into one table; run into another folder"
                )
        before_count = 0
        with path.open(encoding="utf-8") as file:
            for number, line in enumerate(file):
                before_count += 1
                if number < len(jobs) and line != job_line(jobs[number]):
                    _refuse_other_plan(self.path, number, line, jobs[number])
        if before_count != len(jobs):
            raise SimError(
                f"the run in {self.path} has {before_count} episodes, and {len(jobs)} were asked "
                "for: resume with the arguments that began it, which run.json holds, or run into "
                "another folder"
            )

    def _take_up(self) -> None:
        found = read_record_file(self.path / EPISODES)
        os.ftruncate(self._file, found.whole_bytes)
        if found.whole_bytes == 0:
            self._append(_line(RECORD_COLUMNS))
        for record in found.records:
            number = self._keys.get(key_of(record))
            if number is None:
                raise SimError(
                    f"{self.path / EPISODES} holds an episode that {JOBS} does not: "
                    f"{_words(record)}"
                )
            self.done[number] = record
        self._say("running")

    def _append(self, line: bytes) -> None:
        os.write(self._file, line)

    def _say(self, state: str) -> None:
        said = {"state": state, "episodes": self._total, **self._about}
        text = json.dumps(said, indent=2, ensure_ascii=False)
        _write_whole(self.path / RUN, [text + "\n"])


def job_line(job: Job) -> str:
    """A job as a line of ``jobs.jsonl``."""
    return json.dumps(asdict(job), ensure_ascii=False) + "\n"


def job_of(line: str, source: str) -> Job:
    """The job of a line; raises SimError, naming its source, for a line that is none."""
    try:
        data = json.loads(line)
        return Job(**data)
    except (ValueError, TypeError) as cause:
        raise SimError(
            f"{source} is not an episode: it must be an object with the keys "
            f"{', '.join(_FIELDS)} ({cause})"
        ) from cause


def read_jobs(folder: Path) -> tuple[Job, ...]:
    """The jobs of a run; raises SimError for a folder that holds none."""
    path = folder / JOBS
    try:
        with path.open(encoding="utf-8") as file:
            return tuple(
                job_of(line, f"{path}, line {number}") for number, line in enumerate(file, start=1)
            )
    except OSError as cause:
        raise SimError(f"{folder} is not the folder of a run: no {JOBS} in it") from cause


def read_run(folder: Path) -> dict[str, Any]:
    """What ``run.json`` says; empty without one."""
    try:
        said = json.loads((folder / RUN).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return said if isinstance(said, dict) else {}


def key_of(record: EpisodeRecord) -> JobKey:
    """What tells a record from every other one of its run."""
    return JobKey(
        record.scenario,
        record.seed,
        record.policy,
        record.planner,
        record.perception,
        record.fault,
    )


def _words(record: EpisodeRecord) -> str:
    return describe(key_of(record))


def _refuse_other_plan(folder: Path, number: int, line: str, job: Job) -> None:
    before, now = asdict(job_of(line, f"{folder / JOBS}, line {number + 1}")), asdict(job)
    name = next(each for each in _FIELDS if before[each] != now[each])
    values = ""
    if "\n" not in f"{before[name]}{now[name]}":
        values = f" ({before[name]!r}, now {now[name]!r})"
    raise SimError(
        f"the run in {folder} has other episodes than these: episode {number} has another "
        f"{name}{values}; resume with the arguments that began it, which run.json holds, or run "
        "into another folder"
    )


def _line(cells: Iterable[str]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()


def _write_whole(path: Path, lines: Iterable[str]) -> None:
    partial = path.with_name(path.name + ".part")
    with partial.open("w", encoding="utf-8") as file:
        file.writelines(lines)
    partial.replace(path)
