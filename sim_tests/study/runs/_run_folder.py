"""The folder of a run as its writer keeps it, so that an interrupted run can be resumed."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence, Set
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from awarenav.errors import counted
from awarenav.files import atomic_path, write_text
from awarenav.line_files import DamagedLine, LineFile, set_aside

from ...world.errors import SimError
from ..measures import RECORD_COLUMNS, EpisodeRecord, record_row, salvage_record_file, write_records
from ._job import Job
from ._plan import JobKey, describe, job_key
from ._process_lock import ProcessLock
from ._resumed_plan import ResumedPlan, read_plan
from ._run_files import RunFiles, job_line, read_run


class RunFolder(AbstractContextManager["RunFolder"]):
    """The folder of a run, open for writing; a row is in the file as soon as it is added.

    A process that is killed at any moment leaves whole rows and at most one unfinished row.
    Resuming cuts that row off and runs its episode again. A damaged line of ``episodes.csv`` or
    ``jobs.jsonl`` is set aside in a file ``.damaged``, and its episode runs again, too.

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
        self._table: LineFile | None = None
        self._process_lock: ProcessLock | None = None
        self.done: dict[int, EpisodeRecord] = {}
        try:
            path.mkdir(parents=True, exist_ok=True)
            self._table = LineFile(self._files.episodes, SimError)
            self._lock()
            if resume:
                plan = self._check_plan(jobs)
                self._continue(plan.doubtful)
                if plan.damaged:
                    self._write_jobs(jobs)
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
        self._append(record_row(record))
        self.done[number] = record
        if traceback:
            head = f"== episode {number}: {describe(record_key(record))}\n"
            with LineFile(self._files.errors, SimError) as file:
                file.add(f"{head}{traceback.rstrip()}\n\n")

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
        if self._table is not None:
            self._table.close()
            self._table = None

    def _refuse_occupied(self) -> None:
        """Refuse a finished run, an unfinished one with episodes, and another program's table."""
        folder, about = self._files.folder, read_run(self._files.folder)
        done = self._files.episodes.read_bytes().count(b"\n") - 1  # the header is no episode
        if about.get("state") == "running" and done > 0:
            raise SimError(
                f"{folder} holds an unfinished run, with {done} of {about.get('episodes', '?')} "
                "episodes done: go on with --resume, replace it with --overwrite, or choose "
                "another --out"
            )
        if about.get("state") == "complete":
            raise SimError(
                f"{folder} holds a finished run of {_episodes(about.get('episodes', '?'))}: "
                "replace it with --overwrite, choose another --out, or read its table again with "
                "--resume"
            )
        if about.get("state") != "running" and done >= 0:
            raise SimError(
                f"{folder} holds a table {self._files.episodes.name} that is not of a run: there "
                f"is no {self._files.run.name} beside it; choose another --out, or replace it "
                "with --overwrite"
            )

    def _start(self, jobs: Sequence[Job]) -> None:
        # The old table goes first, so that its rows can never be taken for those of the new jobs.
        self._open_table.cut(0)
        files = self._files
        for path in (files.parquet, files.social, files.errors, *files.damaged):
            path.unlink(missing_ok=True)
        self._write_run("running")
        self._write_jobs(jobs)
        self._append(RECORD_COLUMNS)

    def _check_plan(self, jobs: Sequence[Job]) -> ResumedPlan:
        """Return the plan in the folder after checking that it holds these jobs."""
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
        plan = read_plan(path, jobs)
        set_aside(path, plan.damaged, "their episodes run again", SimError)
        count = about.get("episodes", len(jobs)) if plan.damaged else plan.lines
        if count != len(jobs):
            raise SimError(
                f"the run in {folder} has {_episodes(count)}, and {len(jobs)} were asked "
                "for: resume with the arguments that began it, which run.json holds, or run into "
                "another folder"
            )
        return plan

    def _continue(self, doubtful: Set[int]) -> None:
        """Take over the rows of the table; set aside what is damaged, and rows of doubtful jobs."""
        path = self._files.episodes
        found = salvage_record_file(path)
        damaged = list(found.damaged)
        versions: dict[JobKey, set[EpisodeRecord]] = {}
        for _, _, record in found.rows:
            versions.setdefault(record_key(record), set()).add(record)
        for line_number, line, record in found.rows:
            key = record_key(record)
            number = self._keys.get(key)
            if number is None:
                reason = f"no line of {self._files.jobs.name} has this episode: {describe(key)}"
            elif number in doubtful:
                reason = f"the line of its episode in {self._files.jobs.name} is damaged"
            elif len(versions[key]) > 1:  # nothing says which of them is right
                reason = f"another row has this episode: {describe(key)}"
            else:
                self.done[number] = record
                continue
            damaged.append(DamagedLine(line_number, line, reason))
        set_aside(path, damaged, "their episodes run again", SimError)
        if damaged or not found.appendable:
            self._close_table()
            write_records(path, self.done.values())
            self._table = LineFile(path, SimError)
        else:
            self._open_table.cut(found.whole_bytes)
            if found.whole_bytes == 0:
                self._append(RECORD_COLUMNS)
        self._write_run("running")

    @property
    def _open_table(self) -> LineFile:
        if self._table is None:
            raise SimError(f"the folder {self._files.folder} of a run is closed")
        return self._table

    def _append(self, cells: Iterable[str]) -> None:
        line = io.StringIO()
        csv.writer(line, lineterminator="\n").writerow(cells)
        self._open_table.add(line.getvalue())

    def _write_jobs(self, jobs: Iterable[Job]) -> None:
        with (
            atomic_path(self._files.jobs, SimError) as part,
            part.open("w", encoding="utf-8") as file,
        ):
            file.writelines(job_line(job) for job in jobs)

    def _write_run(self, state: str) -> None:
        content = {"state": state, "episodes": self._total, **self._about}
        text = json.dumps(content, indent=2, ensure_ascii=False)
        write_text(self._files.run, text + "\n", SimError)


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


def _episodes(count: int | str) -> str:
    """Return a number of episodes, which an unreadable ``run.json`` leaves unknown, as text."""
    return counted(count, "episode") if isinstance(count, int) else f"{count} episodes"
