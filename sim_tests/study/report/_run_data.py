"""The data of a run as a report reads them; a missing or incomplete file is no error."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

from perception.documents import parse_json, parse_yaml, read_json, read_lines

from ...world.errors import SimError
from ..measures import EpisodeRecord, read_rows
from ..runs import Job, RunFiles
from ._arm import Episode
from ._text import count, plural

# Scenario, version, seed, policy, perception and fault.
_Key = tuple[str, int, int, str, str, str]


@dataclass(frozen=True, slots=True)
class RunData:
    """The data in the folder of a run.

    Attributes:
        path: the folder, as given.
        episodes: the episodes in the order of their numbers.
        jobs: the jobs by their numbers; empty without ``jobs.jsonl``.
        about: content of ``run.json``; empty without the file.
        missing: sentences on what is missing or unfinished.
    """

    path: Path
    episodes: tuple[Episode, ...]
    jobs: tuple[Job, ...]
    about: dict[str, Any]
    missing: tuple[str, ...]

    @classmethod
    def read(cls, path: Path | str) -> RunData:
        """Read a folder.

        Raises:
            SimError: there is no ``episodes.csv``, or it is not a table of episodes.
        """
        path = Path(path)
        files = RunFiles(path)
        missing: list[str] = []
        rows = read_rows(path)
        jobs = _read_jobs(files.jobs, missing)
        about = _read_about(files.run, missing)
        records, repeated = _without_repeats(rows)
        if repeated:
            missing.append(
                f"{plural(repeated, 'row repeats', 'rows repeat')} an episode in "
                f"{files.episodes.name}; the first counts."
            )
        episodes = _numbered(records, jobs)
        waiting = len(jobs) - len(records)
        if jobs and waiting > 0:
            missing.append(
                f"{count(waiting)} of {plural(len(jobs), 'episode')} "
                f"{'has' if waiting == 1 else 'have'} not run yet; the same command with --resume "
                "goes on."
            )
        unknown = sum(episode.number is None for episode in episodes)
        if jobs and unknown:
            missing.append(
                f"{plural(unknown, 'episode')} in {files.episodes.name} without a line in "
                f"{files.jobs.name}, and so without a replay command."
            )
        return cls(path, episodes, jobs, about, tuple(missing))

    def replay(self, episode: Episode) -> str:
        """Return the command that replays an episode; empty where its job is not known."""
        if episode.number is None:
            return ""
        return f"{self.replay_prefix}{episode.number}"

    @property
    def replay_prefix(self) -> str:
        """The replay command up to the number of the episode."""
        return f"awarenav replay {shlex.quote(str(self.path))} "


@lru_cache(maxsize=4096)
def _scenario_identity(text: str) -> tuple[str, int]:
    """Return name and version of a scenario's YAML; an empty name for an unreadable one."""
    try:
        content = parse_yaml(text, "scenario", SimError)
        return str(content["name"]), int(content.get("version", 1))
    except (AttributeError, KeyError, TypeError, ValueError):
        return "", 1


def _read_jobs(path: Path, missing: list[str]) -> tuple[Job, ...]:
    """Return the jobs up to the first unreadable line; note in ``missing`` what is left out."""
    if not path.is_file():
        missing.append(f"There is no {path.name}: episodes have no replay command.")
        return ()
    jobs: list[Job] = []
    names = {field.name for field in fields(Job)}
    for line in read_lines(path, SimError):
        try:
            content = parse_json(line, "job", SimError)
            jobs.append(Job(**{key: content[key] for key in content if key in names}))
        except (ValueError, TypeError):
            # The number of a job is that of its line, so no later line can be used.
            missing.append(
                f"Line {len(jobs) + 1} of {path.name} is unreadable; the rest is left out."
            )
            break
    return tuple(jobs)


def _read_about(path: Path, missing: list[str]) -> dict[str, Any]:
    """Return the content of ``run.json``; note in ``missing`` why it is empty."""
    try:
        if not path.exists():
            missing.append(f"There is no {path.name}: the command and the versions are not known.")
            return {}
        content = read_json(path, SimError)
    except SimError:
        missing.append(f"{path.name} is unreadable: the command and the versions are not known.")
        return {}
    if not isinstance(content, dict):
        missing.append(f"{path.name} holds no mapping: the command and the versions are not known.")
        return {}
    return content


def _without_repeats(
    records: tuple[EpisodeRecord, ...],
) -> tuple[tuple[EpisodeRecord, ...], int]:
    """Return the first record of every episode, and the number of the others."""
    first: dict[tuple[_Key, str], EpisodeRecord] = {}
    for record in records:
        first.setdefault((_key(record), record.planner), record)
    return tuple(first.values()), len(records) - len(first)


def _numbered(records: tuple[EpisodeRecord, ...], jobs: tuple[Job, ...]) -> tuple[Episode, ...]:
    """Return the records as episodes, each with the number of its job."""
    waiting: dict[_Key, list[int]] = {}
    for number, job in enumerate(jobs):
        key = (*_scenario_identity(job.scenario), job.seed, job.policy_name, job.perception)
        waiting.setdefault((*key, job.fault_name), []).append(number)
    episodes = []
    for record in records:
        numbers = waiting.get(_key(record), [])
        found = next((n for n in numbers if _same_planner(jobs[n], record)), None)
        if found is not None:
            numbers.remove(found)
        episodes.append(Episode(found, record))
    return tuple(
        sorted(episodes, key=lambda each: (each.number is None, each.number or 0, each.pair))
    )


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
