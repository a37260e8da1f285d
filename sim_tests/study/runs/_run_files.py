"""An episode as plain data, and the files in the folder of a run, read without the simulator."""

from __future__ import annotations

import platform
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib import metadata
from pathlib import Path
from typing import Any, Final

from perception.documents import parse_json, read_json, read_lines

from ...conditions import Conditions
from ...world.errors import SimError
from ..measures import Conduct, EpisodeRecord, read_records

# Hearing.answers of sim_tests.actors.behaviour, whose import needs the simulator.
DEFAULT_ANSWERS: Final = 0.5
_ANSWERS: Final = re.compile(r"(?:^|,)\s*answers\s*=\s*([^,\s]+)")
_PACKAGES: Final = ("awarenav", "numpy", "scipy", "opencv-python-headless", "pybullet")


@dataclass(frozen=True, slots=True, kw_only=True)
class Job(Conditions):
    """One episode to run: its conditions, and the texts that their names stand for.

    Scenario, policy and fault are YAML text, so that a job gives the same episode on every worker,
    even if the files change in the meantime. Each line of ``jobs.jsonl`` has these fields.

    Attributes:
        scenario_text: YAML of a :class:`Scenario`, with the camera, the robot and the
            population.
        policy_text: YAML of an :class:`AwarenessPolicy`.
        planner_text: ``"module:Class"``, empty for the reference planner.
        fault_text: YAML of a :class:`Fault`, empty for none.
    """

    scenario_text: str
    policy_text: str
    planner_text: str = ""
    fault_text: str = ""


#: Names of the fields of a job, the keys of each line of ``jobs.jsonl``.
JOB_FIELDS: Final = tuple(field.name for field in fields(Job))


@dataclass(frozen=True, slots=True)
class Attempt:
    """The outcome of one episode.

    Attributes:
        record: its row in ``episodes.csv``.
        traceback: of the error that ended it; empty without one.
        conduct: conduct of its planner; None where it is not known.
        number: number of its job, from 0, as ``awarenav replay`` takes it; None without a job.
    """

    record: EpisodeRecord
    traceback: str = ""
    conduct: Conduct | None = None
    number: int | None = None


def versions() -> dict[str, str]:
    """Return the versions that results depend on, beside the jobs themselves."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # pragma: no cover - a checkout that is not installed
            found[name] = "unknown"
    return found


class RunFiles:
    """The paths of the files in the folder of a run.

    Attributes:
        folder: of the run.
        run: state, versions, command and settings of the run.
        jobs: the planned episodes, one job per line.
        ended: the folder with one file for each episode that has ended.
        episodes: the table of these episodes, one row per episode.
        parquet: the same table as Parquet, of a complete run.
        errors: tracebacks of failed episodes; absent if none failed.
        replays: the folder of videos, maps and pages of episodes that were replayed.
        social: the table of ``awarenav measures``, one row per episode.
        exports: the folder of episodes in the formats of other projects.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.run = folder / "run.json"
        self.jobs = folder / "jobs.jsonl"
        self.ended = folder / "episodes"
        self.episodes = folder / "episodes.csv"
        self.parquet = folder / "episodes.parquet"
        self.errors = folder / "errors.log"
        self.replays = folder / "replays"
        self.social = folder / "social.csv"
        self.exports = folder / "exports"

    def episode(self, number: int) -> Path:
        """Return the path of the file of an episode."""
        return self.ended / f"{number:05d}.json"

    def page(self, number: int) -> Path:
        """Return the path of the replay page of an episode."""
        return self.replays / f"episode_{number:05d}.html"


def read_jobs(folder: Path) -> tuple[Job, ...]:
    """Return the jobs of a run; raise SimError for a folder that holds none."""
    path = RunFiles(folder).jobs
    if not path.is_file():
        raise SimError(f"{folder} is not the folder of a run: no {path.name} in it")
    return tuple(
        _parse_job(line, f"{path}, line {number}")
        for number, line in enumerate(read_lines(path, SimError), start=1)
    )


def _parse_job(line: str | bytes, source: str) -> Job:
    try:
        values = parse_json(line, source, SimError)
        return Job(**values)
    except (ValueError, TypeError, KeyError) as cause:
        raise SimError(
            f"{source} is not an episode: it must be an object with the keys "
            f"{', '.join(JOB_FIELDS)} ({cause})"
        ) from cause


def read_run(folder: Path) -> dict[str, Any]:
    """Return the content of ``run.json``; empty without one."""
    try:
        content = read_json(RunFiles(folder).run, SimError)
    except SimError:
        return {}
    return content if isinstance(content, dict) else {}


def read_rows(folder: Path | str) -> tuple[EpisodeRecord, ...]:
    """Return the episodes of a run that have ended, in the order of its jobs.

    Args:
        folder: of a run, finished or not; or a table of episodes, CSV or Parquet.

    Raises:
        SimError: there is no run, or a file that is not of one; the message names it.
    """
    path = Path(folder)
    if not path.is_dir():
        return read_records(path)
    table = RunFiles(path).episodes
    # A killed run has no table, or an old one.
    if read_run(path).get("state") != "complete" and (ended := read_attempts(path)):
        return tuple(attempt.record for attempt in ended.values())
    if not table.is_file():
        raise SimError(
            f"{path} holds no {table.name}; give the folder that `awarenav crossings --out DIR` "
            "wrote"
        )
    return read_records(table)


def read_attempts(folder: Path) -> dict[int, Attempt]:
    """Return the outcome of every episode that has ended, by its number.

    Raises:
        SimError: a file that is not of an episode of this run; the message names it.
    """
    ended = RunFiles(folder).ended
    found = {}
    for path in sorted(ended.glob("*.json")) if ended.is_dir() else ():
        try:
            number = int(path.stem)
            content = read_json(path, SimError)
            conduct = content["conduct"]
            attempt = Attempt(
                EpisodeRecord(**content["record"]),
                content["traceback"],
                None if conduct is None else Conduct(**conduct),
                number,
            )
        except (ValueError, TypeError, KeyError) as cause:
            raise not_of_this_run(path, str(cause)) from cause
        found[number] = attempt
    return found


def not_of_this_run(path: Path, reason: str) -> SimError:
    """Return the error about a file that is not of an episode of its run."""
    return SimError(
        f"{path} is not the file of an episode of this run ({reason}): move it away, and "
        "--resume runs its episode again"
    )


def answering_note(about: Any) -> str:
    """Return a sentence on the probability with which simulated people answer a request.

    Returns:
        The sentence; empty where the settings of the run are not known.
    """
    settings = about.get("settings") if isinstance(about, Mapping) else None
    if not isinstance(settings, Mapping):
        return ""
    given = settings.get("population") or ""
    population = given if isinstance(given, str) else ", ".join(map(str, given))
    found = _ANSWERS.findall(population)
    if found:
        share, source = ", ".join(found), f"population {population}"
    else:
        share, source = f"{DEFAULT_ANSWERS:g}", "the default, unless a scenario has its own"
    return f"Simulated people answer a request that they hear with probability {share}\n({source})."
