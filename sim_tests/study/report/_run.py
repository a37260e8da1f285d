"""The data of a run as reports read them; the only module of this package that reads its files."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from awarenav.errors import counted

from ...world.errors import SimError
from ..measures import Conduct, EpisodeRecord
from ..runs import Job, RunFiles, read_attempts, read_jobs, read_rows, read_run

#: Key in ``run.json`` of the policy with wider radii, by which planners are probed.
WIDE_KEY: Final = "wide_policy"


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode of a run.

    Attributes:
        number: number of its job, from 0, as ``awarenav replay`` takes it; None without a job.
        record: its row in ``episodes.csv``.
        conduct: conduct of its planner; None where it is not known.
    """

    number: int | None
    record: EpisodeRecord
    conduct: Conduct | None = None


@dataclass(frozen=True, slots=True)
class Run:
    """The data in the folder of a run.

    Attributes:
        path: the folder, as given.
        episodes: the episodes that have ended, in the order of the jobs.
        jobs: the jobs by their numbers; empty where they cannot be read.
        about: content of ``run.json``; empty where it cannot be read.
        missing: sentences on what is missing or unfinished.
    """

    path: Path
    episodes: tuple[Episode, ...]
    jobs: tuple[Job, ...]
    about: dict[str, Any]
    missing: tuple[str, ...]

    @classmethod
    def read(cls, path: Path | str) -> Run:
        """Read a folder; ``episodes.csv`` alone is enough.

        Raises:
            SimError: it holds no episodes, or a file of an episode cannot be read.
        """
        path, missing = Path(path), []
        files, about = RunFiles(path), read_run(Path(path))
        try:
            jobs = read_jobs(path)
        except SimError:
            jobs = ()
            missing.append(f"{files.jobs.name} cannot be read: episodes have no replay command.")
        if not about:
            missing.append(
                f"{files.run.name} cannot be read: the command and the versions are not known."
            )
        if attempts := read_attempts(path) if jobs else {}:
            episodes = [Episode(n, each.record, each.conduct) for n, each in attempts.items()]
        else:
            records = read_rows(path)
            # A whole table is in the order of its jobs.
            is_whole = len(records) == len(jobs) and all(map(_fits, jobs, records))
            numbers = range(len(jobs)) if is_whole else [None] * len(records)
            episodes = [Episode(*each) for each in zip(numbers, records, strict=True)]
        if waiting := max(len(jobs) - len(episodes), 0):
            missing.append(
                f"{waiting} of {counted(len(jobs), 'episode')} did not run yet; the same command "
                "with --resume goes on."
            )
        return cls(path, tuple(episodes), jobs, about, tuple(missing))

    @property
    def wide_policy(self) -> str:
        """Name of the policy of the probe of wider radii; empty without a probe."""
        return str(self.about.get(WIDE_KEY, ""))

    def replay(self, episode: Episode) -> str:
        """Return the command that replays an episode; empty where its job is not known."""
        if episode.number is None:
            return ""
        return f"awarenav replay {shlex.quote(str(self.path))} {episode.number}"

    def page(self, episode: Episode, folder: Path) -> str:
        """Return the address of an episode's replay page, from a folder; empty without a page."""
        if episode.number is None:
            return ""
        page = RunFiles(self.path).page(episode.number)
        return quote(Path(os.path.relpath(page, folder)).as_posix()) if page.is_file() else ""


def _fits(job: Job, record: EpisodeRecord) -> bool:
    """Return whether a row can be that of a job."""
    return job.conditions == record.conditions
