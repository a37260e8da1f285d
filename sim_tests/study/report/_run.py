"""The data of a run as reports read them; a missing or incomplete file is no error."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from awarenav.errors import counted
from perception.documents import parse_yaml

from ...world.errors import SimError
from ..measures import Conduct, EpisodeRecord, read_record_file
from ..runs import Job, RunFiles, read_jobs, read_run
from ._conducts import read_conducts

#: Key in ``run.json`` of the policy with wider radii, by which planners are probed.
WIDE_KEY: Final = "wide_policy"
# Scenario, version, seed, policy, perception and fault.
_Key = tuple[str, int, int, str, str, str]


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
        episodes: the episodes in the order of their numbers.
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
        """Read a folder.

        Raises:
            SimError: there is no ``episodes.csv``, or it is not a table of episodes.
        """
        path = Path(path)
        files = RunFiles(path)
        if not files.episodes.is_file():
            raise SimError(
                f"{path} holds no {files.episodes.name}; give the folder that "
                "`awarenav crossings --out DIR` wrote"
            )
        table, missing = read_record_file(files.episodes), []
        if table.torn:
            missing.append(f"The last row of {files.episodes.name} is unfinished and left out.")
        try:
            jobs = read_jobs(path)
        except SimError:
            jobs = ()
            missing.append(f"{files.jobs.name} cannot be read: episodes have no replay command.")
        about = read_run(path)
        if not about:
            missing.append(
                f"{files.run.name} cannot be read: the command and the versions are not known."
            )
        records: dict[tuple[_Key, str], EpisodeRecord] = {}
        for record in table.records:
            records.setdefault((_key(record), record.planner), record)
        if repeated := len(table.records) - len(records):
            missing.append(
                f"{counted(repeated, 'row')} of {files.episodes.name} repeated an episode; the "
                "first counts."
            )
        if waiting := max(len(jobs) - len(records), 0):
            missing.append(
                f"{waiting} of {counted(len(jobs), 'episode')} did not run yet; the same command "
                "with --resume goes on."
            )
        episodes = _numbered(tuple(records.values()), jobs, read_conducts(path))
        unknown = sum(each.number is None for each in episodes)
        if jobs and unknown:
            missing.append(
                f"{counted(unknown, 'episode')} without a line in {files.jobs.name}, and so "
                "without a replay command."
            )
        return cls(path, episodes, jobs, about, tuple(missing))

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


@lru_cache(maxsize=4096)
def _scenario_identity(text: str) -> tuple[str, int]:
    """Return name and version of a scenario's YAML; an empty name for an unreadable one."""
    try:
        content = parse_yaml(text, "scenario", SimError)
        return str(content["name"]), int(content.get("version", 1))
    except (AttributeError, KeyError, TypeError, ValueError):
        return "", 1


def _numbered(
    records: tuple[EpisodeRecord, ...], jobs: tuple[Job, ...], conducts: dict[int, Conduct]
) -> tuple[Episode, ...]:
    """Return the records as episodes, each with the number of its job."""
    waiting: dict[_Key, list[int]] = {}
    for number, job in enumerate(jobs):
        key = (*_scenario_identity(job.scenario), job.seed, job.policy_name, job.perception)
        waiting.setdefault((*key, job.fault_name), []).append(number)
    episodes = []
    for record in records:
        numbers = waiting.get(_key(record), [])
        found = next((n for n in numbers if _same_planner(jobs[n], record)), None)
        if found is None:
            episodes.append(Episode(None, record))
        else:
            numbers.remove(found)
            episodes.append(Episode(found, record, conducts.get(found)))
    return tuple(sorted(episodes, key=lambda e: (e.number is None, e.number or 0, _key(e.record))))


def _key(record: EpisodeRecord) -> _Key:
    return (
        record.scenario,
        record.scenario_version,
        record.seed,
        record.policy,
        record.perception,
        record.fault,
    )


def _same_planner(job: Job, record: EpisodeRecord) -> bool:
    return not job.planner or job.planner.rpartition(":")[2] == record.planner or not record.planner
