"""One episode to run, as plain data, its key in tables, and the versions it depends on."""

from __future__ import annotations

import platform
from dataclasses import dataclass, fields
from functools import lru_cache
from importlib import metadata
from typing import Final, NamedTuple, TypeVar

import yaml
from pydantic import ValidationError

from nav_adapter import AwarenessPolicy
from perception.documents import parse_yaml, yaml_text
from tracking.config import StrictConfig, complaints

from ...crossing.faults import Fault
from ...scenario import ScenarioTemplate
from ...world.errors import SimError
from ._planner_choice import planner_label

_ConfigT = TypeVar("_ConfigT", bound=StrictConfig)


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


def job_key(job: Job) -> JobKey:
    """Return the key of a job, which is unique in its run."""
    scenario = template_of(job.scenario).median()
    label = planner_label(job.planner, scenario)
    return JobKey(scenario.name, job.seed, job.policy_name, label, job.perception, job.fault_name)


def describe(key: JobKey) -> str:
    """Return an episode in words."""
    fault = f", fault {key.fault}" if key.fault else ""
    return (
        f"{key.scenario}, seed {key.seed}, policy {key.policy}, {key.planner}, "
        f"perception {key.perception}{fault}"
    )


@lru_cache(maxsize=256)
def template_of(text: str) -> ScenarioTemplate:
    """Return the scenario of a job; raise SimError for YAML that holds none."""
    return ScenarioTemplate.from_text(text)


@lru_cache(maxsize=256)
def policy_of(text: str) -> AwarenessPolicy:
    """Return the policy of a job; raise SimError for YAML that holds none."""
    return _of_text("policy", AwarenessPolicy, text)


@lru_cache(maxsize=256)
def fault_of(text: str) -> Fault | None:
    """Return the fault of a job, None without one; raise SimError for YAML that holds none."""
    return _of_text("fault", Fault, text) if text else None


def _of_text(name: str, kind: type[_ConfigT], text: str) -> _ConfigT:
    try:
        return kind.model_validate(parse_yaml(text, "it", SimError))
    except ValidationError as cause:
        raise SimError(f"the {name} of an episode is not valid: {complaints(cause)}") from cause
    except SimError as cause:
        raise SimError(f"the {name} of an episode is not valid: {cause}") from cause


def policy_text(policy: AwarenessPolicy) -> str:
    """Return a policy as YAML; raise SimError for one with objects that YAML cannot hold."""
    try:
        return yaml_text(policy.model_dump(mode="json"))
    except (TypeError, ValueError, yaml.YAMLError) as cause:
        raise SimError(
            f"a policy must be one that YAML can hold, without objects of your own: {cause}"
        ) from cause


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
