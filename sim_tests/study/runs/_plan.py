"""Which episodes to run: every combination of what is compared, on the same seeds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Final, NamedTuple, get_args

import yaml
from pydantic import ValidationError

from awarenav.errors import not_one_of
from nav_adapter import AwarenessPolicy
from perception.arrays import finite_number

from ...crossing.eyes import ORACLE, PerceptionKind
from ...crossing.faults import Fault
from ...scenario import ScenarioTemplate, shipped_templates
from ...world.errors import SimError
from ._job import Job
from ._planner_choice import make_planner, planner_label

#: As a fault: none.
NO_FAULT: Final = "none"


class JobKey(NamedTuple):
    """What tells an episode from every other one of a run, as its row in the table has it."""

    scenario: str
    seed: int
    policy: str
    planner: str
    perception: str
    fault: str


def plan_jobs(
    scenarios: Sequence[str | ScenarioTemplate],
    policies: Sequence[str | tuple[str, AwarenessPolicy]],
    seeds: Iterable[int],
    *,
    planners: Sequence[str] = ("",),
    perception: str = "keypoints",
    faults: Sequence[str | Fault] = ("",),
    camera: str = "",
) -> tuple[Job, ...]:
    """Every scenario with every seed under every fault, planner and policy, in that order.

    Args:
        scenarios: templates, shipped names, YAML files, or ``"all"``: those that are shipped and
            need a planner.
        policies: presets' names, YAML files, ``"oracle"`` (``balanced`` with perception that knows
            the truth: what better eyes could win at most), or pairs of a name for the tables and a
            policy.
        seeds: of the episodes, the same for all.
        planners: ``"module:Class"``, or empty for the reference planner.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        faults: shipped names, YAML files, ``"none"`` or empty for none, or faults.
        camera: a shipped name or a YAML file, in place of every scenario's own; empty for those.

    Raises:
        SimError: something of that is unknown or unusable, or two episodes could not be told apart
            in a table.
        NavError: an unknown preset or unusable policy file.
    """
    if perception not in get_args(PerceptionKind):
        raise SimError(not_one_of("perception", perception, get_args(PerceptionKind)))
    templates = [
        template.with_camera(camera) for each in scenarios for template in _templates(each)
    ]
    named = [_policy(each, perception) for each in policies]
    broken = [_fault(each) for each in faults]
    numbers = [_seed(seed) for seed in seeds]
    for planner in planners:
        if planner and templates:
            make_planner(planner, templates[0].median())  # says at once what is wrong with it
    jobs = tuple(
        Job(text, seed, name, policy, planner, sees, fault_name, fault)
        for text in (template.to_text() for template in templates)
        for seed in numbers
        for fault_name, fault in broken
        for planner in planners
        for name, policy, sees in named
    )
    seen: set[JobKey] = set()
    for job in jobs:
        key = job_key(job)
        if key in seen:
            raise SimError(
                "two episodes have the same scenario name, seed, policy, planner, perception and "
                f"fault: {describe(key)}; give each a name of its own, and each only once"
            )
        seen.add(key)
    return jobs


def job_key(job: Job) -> JobKey:
    """What tells the episode from every other one of a run."""
    scenario = template_of(job.scenario).median()
    label = planner_label(job.planner, scenario)
    return JobKey(scenario.name, job.seed, job.policy_name, label, job.perception, job.fault_name)


def describe(key: JobKey) -> str:
    """An episode in words."""
    fault = f", fault {key.fault}" if key.fault else ""
    return (
        f"{key.scenario}, seed {key.seed}, policy {key.policy}, {key.planner}, "
        f"perception {key.perception}{fault}"
    )


@lru_cache(maxsize=256)
def template_of(text: str) -> ScenarioTemplate:
    """The scenario of a job; raises SimError for YAML that is none."""
    return ScenarioTemplate.from_text(text)


@lru_cache(maxsize=256)
def policy_of(text: str) -> AwarenessPolicy:
    """The policy of a job; raises SimError for YAML that is none."""
    try:
        return AwarenessPolicy.model_validate(yaml.safe_load(text))
    except (ValidationError, yaml.YAMLError) as cause:
        raise SimError(f"the policy of an episode is not valid: {cause}") from cause


@lru_cache(maxsize=256)
def fault_of(text: str) -> Fault | None:
    """The fault of a job, None without one; raises SimError for YAML that is none."""
    if not text:
        return None
    try:
        return Fault.model_validate(yaml.safe_load(text))
    except (ValidationError, yaml.YAMLError) as cause:
        raise SimError(f"the fault of an episode is not valid: {cause}") from cause


def policy_text(policy: AwarenessPolicy) -> str:
    """A policy as YAML; raises SimError for one with own objects, which cannot be written."""
    try:
        data = policy.model_dump(mode="json")
        return yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    except (TypeError, ValueError, yaml.YAMLError) as cause:
        raise SimError(
            f"a policy must be one that YAML can hold, without objects of your own: {cause}"
        ) from cause


def _templates(scenario: str | ScenarioTemplate) -> list[ScenarioTemplate]:
    if isinstance(scenario, ScenarioTemplate):
        return [scenario]
    if scenario == "all":
        return [
            template
            for template in shipped_templates()
            if template.median().robot.straight_on_speed_mps is None
        ]
    return [ScenarioTemplate.named(scenario)]


def _policy(policy: str | tuple[str, AwarenessPolicy], perception: str) -> tuple[str, str, str]:
    """Name, YAML, and what the robot sees with."""
    if not isinstance(policy, str):
        name, given = policy
        return name, policy_text(given), perception
    if policy == ORACLE:
        return ORACLE, policy_text(AwarenessPolicy.preset("balanced")), ORACLE
    if policy.endswith((".yaml", ".yml")):
        return Path(policy).stem, policy_text(AwarenessPolicy.from_yaml(policy)), perception
    return policy, policy_text(AwarenessPolicy.preset(policy)), perception


def _fault(fault: str | Fault) -> tuple[str, str]:
    """Name and YAML, both empty for none."""
    if isinstance(fault, str):
        if fault in ("", NO_FAULT):
            return "", ""
        fault = Fault.of(fault)
    if fault.name == NO_FAULT:
        raise SimError(f"a fault must have a name of its own, got {fault.name!r}")
    return fault.name, fault.to_text()


def _seed(seed: int) -> int:
    number = finite_number("seed", seed, SimError, minimum=0)
    if number != int(seed):
        raise SimError(f"seed must be a whole number, got {seed!r}")
    return int(seed)
