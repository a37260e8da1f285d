"""The files in the folder of a run, and how its jobs and its ``run.json`` are read."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

from perception.documents import parse_json, read_json, read_lines

from ...world.errors import SimError
from ._job import Job

#: Names of the fields of a job, the keys of each line of ``jobs.jsonl``.
JOB_FIELDS: Final = tuple(field.name for field in fields(Job))


@dataclass(frozen=True, slots=True)
class RunFiles:
    """The paths of the files in the folder of a run."""

    folder: Path

    @property
    def jobs(self) -> Path:
        """The planned episodes, one job per line."""
        return self.folder / "jobs.jsonl"

    @property
    def episodes(self) -> Path:
        """The table of finished episodes, one row per episode."""
        return self.folder / "episodes.csv"

    @property
    def parquet(self) -> Path:
        """The same table as Parquet, of a complete run."""
        return self.folder / "episodes.parquet"

    @property
    def run(self) -> Path:
        """State, versions, command and settings of the run."""
        return self.folder / "run.json"

    @property
    def errors(self) -> Path:
        """Tracebacks of failed episodes; absent if none failed."""
        return self.folder / "errors.log"

    @property
    def damaged(self) -> tuple[Path, ...]:
        """Lines of the table and of the plan that were damaged; absent if none was."""
        return tuple(path.with_name(path.name + ".damaged") for path in (self.episodes, self.jobs))

    @property
    def replays(self) -> Path:
        """The folder of videos, maps and pages of episodes that were replayed."""
        return self.folder / "replays"

    @property
    def social(self) -> Path:
        """The table of ``awarenav measures``, one row per episode."""
        return self.folder / "social.csv"

    @property
    def exports(self) -> Path:
        """The folder of episodes in the formats of other projects."""
        return self.folder / "exports"

    def page(self, number: int) -> Path:
        """Return the path of the replay page of an episode."""
        return self.replays / f"episode_{number:05d}.html"

    @property
    def lock(self) -> Path:
        """The lock file of the process that runs episodes into the folder."""
        return self.folder / ".lock"


def job_line(job: Job) -> str:
    """Return a job as a line of ``jobs.jsonl``."""
    return json.dumps(asdict(job), ensure_ascii=False) + "\n"


def parse_job(line: str | bytes, source: str) -> Job:
    """Return the job of a line; raise SimError, naming the source, for a line that is none."""
    try:
        return Job(**parse_json(line, source, SimError))
    except (ValueError, TypeError) as cause:
        raise SimError(
            f"{source} is not an episode: it must be an object with the keys "
            f"{', '.join(JOB_FIELDS)} ({cause})"
        ) from cause


def read_jobs(folder: Path) -> tuple[Job, ...]:
    """Return the jobs of a run; raise SimError for a folder that holds none."""
    path = RunFiles(folder).jobs
    if not path.is_file():
        raise SimError(f"{folder} is not the folder of a run: no {path.name} in it")
    return tuple(
        parse_job(line, f"{path}, line {number}")
        for number, line in enumerate(read_lines(path, SimError), start=1)
    )


def read_run(folder: Path) -> dict[str, Any]:
    """Return the content of ``run.json``; empty without one."""
    try:
        content = read_json(RunFiles(folder).run, SimError)
    except SimError:
        return {}
    return content if isinstance(content, dict) else {}
