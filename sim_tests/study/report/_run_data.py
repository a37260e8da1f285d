"""A run's folder, read with patience: what is torn or missing is said, not fatal."""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import yaml

from ...world.errors import SimError
from ..measures import EpisodeRecord, read_record_file
from ..runs import Job
from ._arm import Episode
from ._text import count, plural

_EPISODES: Final = "episodes.csv"
_JOBS: Final = "jobs.jsonl"
_RUN: Final = "run.json"

Key = tuple[str, int, int, str, str, str]


@dataclass(frozen=True, slots=True)
class RunData:
    """What a run left behind.

    Attributes:
        path: of the folder, as given.
        episodes: in the order of their numbers.
        jobs: by their numbers; empty without ``jobs.jsonl``.
        run: content of ``run.json``; empty without.
        missing: what is missing or unfinished, a sentence each.
    """

    path: Path
    episodes: tuple[Episode, ...]
    jobs: tuple[Job, ...]
    run: dict[str, Any]
    missing: tuple[str, ...]

    @classmethod
    def read(cls, path: Path | str) -> RunData:
        """Read a folder.

        Raises:
            SimError: there is no ``episodes.csv``, or it is no table of episodes.
        """
        path = Path(path)
        if not (path / _EPISODES).is_file():
            raise SimError(
                f"{path} holds no {_EPISODES}; give the folder that `awarenav crossings --out DIR` "
                "wrote"
            )
        missing: list[str] = []
        table = read_record_file(path / _EPISODES)
        if table.torn:
            missing.append(f"The last row of {_EPISODES} is unfinished and left out.")
        jobs = _read_jobs(path / _JOBS, missing)
        run = _read_run(path / _RUN, missing)
        records, twice = _once(table.records)
        if twice:
            missing.append(
                f"{plural(twice, 'row')} of {_EPISODES} repeat an episode; the first counts."
            )
        episodes = _numbered(records, jobs)
        if jobs and len(records) < len(jobs):
            missing.append(
                f"{count(len(jobs) - len(records))} of {plural(len(jobs), 'episode')} have "
                "not run yet; the same command with --resume runs them."
            )
        unknown = sum(episode.number is None for episode in episodes)
        if jobs and unknown:
            missing.append(
                f"{plural(unknown, 'episode')} in {_EPISODES} stand in no line of {_JOBS}, so they "
                "have no replay command."
            )
        return cls(path, episodes, jobs, run, tuple(missing))

    def replay(self, episode: Episode) -> str:
        """The command that shows an episode again; empty where its job is not known."""
        if episode.number is None:
            return ""
        return f"{self.replay_prefix}{episode.number}"

    @property
    def replay_prefix(self) -> str:
        """The command up to the number."""
        return f"awarenav replay {shlex.quote(str(self.path))} "


@lru_cache(maxsize=4096)
def scenario_identity(text: str) -> tuple[str, int]:
    """Name and version of a scenario's YAML; an empty name where it cannot be read."""
    try:
        content = yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
        return str(content["name"]), int(content.get("version", 1))
    except (yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError):
        return "", 1


def _read_jobs(path: Path, missing: list[str]) -> tuple[Job, ...]:
    if not path.is_file():
        missing.append(f"There is no {_JOBS}: episodes have no replay command.")
        return ()
    jobs: list[Job] = []
    names = {field.name for field in fields(Job)}
    for line in path.read_text("utf-8", errors="replace").splitlines():
        try:
            content = json.loads(line)
            jobs.append(Job(**{key: content[key] for key in content if key in names}))
        except (ValueError, TypeError):
            # Numbers count lines, so nothing after this one may be used.
            missing.append(f"Line {len(jobs) + 1} of {_JOBS} is unreadable; the rest is left out.")
            break
    return tuple(jobs)


def _read_run(path: Path, missing: list[str]) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        missing.append(f"There is no {_RUN}: the command and the versions are not known.")
        return {}
    except (OSError, ValueError):
        missing.append(f"{_RUN} is unreadable: the command and the versions are not known.")
        return {}
    if not isinstance(content, dict):
        missing.append(f"{_RUN} holds no mapping: the command and the versions are not known.")
        return {}
    return content


def _once(records: tuple[EpisodeRecord, ...]) -> tuple[tuple[EpisodeRecord, ...], int]:
    """The first record of every episode, and how many others there were."""
    first: dict[tuple[Key, str], EpisodeRecord] = {}
    for record in records:
        first.setdefault((_key(record), record.planner), record)
    return tuple(first.values()), len(records) - len(first)


def _numbered(records: tuple[EpisodeRecord, ...], jobs: tuple[Job, ...]) -> tuple[Episode, ...]:
    """Records with the number of the job that each came from."""
    waiting: dict[Key, list[int]] = {}
    for number, job in enumerate(jobs):
        key = (*scenario_identity(job.scenario), job.seed, job.policy_name, job.perception)
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


def _key(record: EpisodeRecord) -> Key:
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
