"""An episode as plain data: its job, its key, its outcome, and the versions it depends on."""

from __future__ import annotations

import platform
from dataclasses import dataclass, fields
from importlib import metadata
from typing import Final, NamedTuple

from ..measures import Conduct, EpisodeRecord


@dataclass(frozen=True, slots=True)
class Job:
    """One episode to run.

    Scenario, policy and fault are YAML text, so that a job gives the same episode on every worker,
    even if the files change in the meantime.

    Attributes:
        scenario: YAML of a :class:`ScenarioTemplate`.
        seed: seed of the episode.
        policy_name: name of the policy in tables.
        policy: YAML of an :class:`AwarenessPolicy`.
        planner: ``"module:Class"``, empty for the reference planner.
        perception: as for :func:`sim_tests.run_crossing`.
        fault_name: name of the fault in tables, empty for none.
        fault: YAML of a :class:`Fault`, empty for none.
    """

    scenario: str
    seed: int
    policy_name: str
    policy: str
    planner: str = ""
    perception: str = "keypoints"
    fault_name: str = ""
    fault: str = ""


#: Names of the fields of a job, the keys of each line of ``jobs.jsonl``.
JOB_FIELDS: Final = tuple(field.name for field in fields(Job))


class JobKey(NamedTuple):
    """The key of an episode, unique in its run; its row in the table holds the same values."""

    scenario: str
    seed: int
    policy: str
    planner: str
    perception: str
    fault: str


def describe(key: JobKey) -> str:
    """Return an episode in words."""
    fault = f", fault {key.fault}" if key.fault else ""
    return (
        f"{key.scenario}, seed {key.seed}, policy {key.policy}, {key.planner}, "
        f"perception {key.perception}{fault}"
    )


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


@dataclass(frozen=True, slots=True)
class Attempt:
    """The outcome of one episode.

    Attributes:
        record: its row in the table.
        traceback: of the error that ended it; empty without an error.
        conduct: of its planner; None for an episode that ended with an error.
    """

    record: EpisodeRecord
    traceback: str = ""
    conduct: Conduct | None = None


_PACKAGES: Final = ("awarenav", "numpy", "scipy", "opencv-python-headless", "pybullet")


def versions() -> dict[str, str]:
    """Return the versions that results depend on, beside the jobs themselves."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # pragma: no cover - a checkout that is not installed
            found[name] = "unknown"
    return found
