"""The plan of a run: every combination of what it varies, or a random sample of them."""

from __future__ import annotations

import fnmatch
import itertools
import math
import re
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
import yaml
from pydantic import ValidationError

from nav_adapter import AwarenessPolicy
from perception.arrays import finite_number
from perception.documents import parse_yaml, yaml_text
from tracking.config import StrictConfig, complaints

from ...conditions import (
    AXES,
    NO_FAULT,
    ORACLE,
    Experiment,
    Perception,
    changed_scenario,
    option_words,
    refuse_unused_networks,
    table_name,
)
from ...crossing import named_policy
from ...crossing.faults import Fault, shipped_faults
from ...crossing.planner import planner_label, refuse_unusable_planner
from ...scenario import SCENARIO_SETS, Scenario, shipped_scenarios
from ...world.config import checked_seed
from ...world.errors import SimError
from ._run_files import Job

_ConfigT = TypeVar("_ConfigT", bound=StrictConfig)

_PATTERN: Final = re.compile(r"[*?\[]")
# Makes the draw of a sample independent of the episodes, whose generators have the seed alone.
_STREAM: Final = 83
# More conditions do not fit into memory.
_MOST_EPISODES: Final = 10**7


def plan_jobs(
    scenarios: Sequence[str | Scenario],
    policies: Sequence[str | tuple[str, AwarenessPolicy]],
    seeds: Iterable[int],
    *,
    planners: Sequence[str] = ("",),
    perception: str = "keypoints",
    sensors: Sequence[str] = ("camera",),
    faults: Sequence[str | Fault] = ("",),
    **axes: str,
) -> tuple[Job, ...]:
    """Return the jobs of every scenario, seed, fault, planner, policy and set of sensors.

    They are nested in that order.

    Args:
        scenarios: scenarios, shipped names, YAML files, or sets (:data:`SCENARIO_SETS`)
            without the scenarios that need no planner.
        policies: names of presets, YAML files, pairs of a name for the tables and a policy, or
            ``"oracle"``. The oracle is ``balanced`` with perception that knows the truth: the
            upper bound of what better perception could gain.
        seeds: seeds of the episodes, the same for all combinations.
        planners: ``"module:Class"``, or empty for the reference planner.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        sensors: ``"camera"``, ``"camera+scanner"`` or ``"scanner"``, which has no use for the
            perception; one set or several to compare.
        faults: faults, shipped names, YAML files, or ``"none"`` or empty for no fault. ``*``, ``?``
            and ``[…]`` in a name stand for all shipped names that fit, as in a shell; in names that
            are joined by ``+`` for every combination.
        axes: the other conditions, which change every scenario: ``camera`` and ``robot`` (a shipped
            name or a YAML file), ``networks`` (a YAML file) and ``population``; empty keeps each
            scenario's own.

    Raises:
        SimError: an unknown or unusable argument, or two episodes with the same conditions.
        NavError: an unknown preset or unusable policy file.
    """
    perceptions = [Perception.of(perception, each).name for each in sensors]
    refuse_unused_networks(axes, perception)
    expanded = _expanded(scenarios, axes)
    policy_texts = [text for each in policies for text in _named_policy(each, perceptions)]
    fault_texts = [_named_fault(each) for given in faults for each in _matching_faults(given)]
    seeds = seeds if isinstance(seeds, range) else tuple(seeds)
    count = math.prod(map(len, (expanded, seeds, fault_texts, planners, policy_texts)))
    if count > _MOST_EPISODES:  # before their list fills the memory
        raise SimError(f"a run has at most {_MOST_EPISODES} episodes, got {count}")
    checked_seeds = [checked_seed(seed) for seed in seeds]
    names = {name: table_name(value) for name, value in axes.items()}
    for planner in planners:
        if expanded:
            refuse_unusable_planner(planner, expanded[0])
    jobs = tuple(
        Job(
            scenario.name,
            seed,
            policy_name,
            planner_label(planner, scenario),
            policy_perception,
            fault=fault_name,
            **names,
            scenario_text=text,
            policy_text=policy,
            planner_text=planner,
            fault_text=fault,
        )
        for scenario, text in ((each, each.to_text()) for each in expanded)
        for seed in checked_seeds
        for fault_name, fault in fault_texts
        for planner in planners
        for policy_name, policy, policy_perception in policy_texts
    )
    twice = [key for key, count in Counter(job.conditions for job in jobs).items() if count > 1]
    if twice:
        raise SimError(
            f"two episodes have the same {', '.join(AXES[:-1])} and {AXES[-1]}: {twice[0].text}; "
            "give each a name of its own, and each only once"
        )
    return jobs


def experiment_jobs(
    experiment: Experiment, policies: Sequence[str | tuple[str, AwarenessPolicy]] | None = None
) -> tuple[Job, ...]:
    """Return the episodes of a command; :func:`plan_jobs` names the errors."""
    first = experiment["seed"]
    return tuple(
        job
        for population in dict.fromkeys(experiment["population"] or ("",))
        for job in plan_jobs(
            experiment["scenario"],
            experiment["policy"] if policies is None else policies,
            range(first, first + experiment.episodes),
            planners=experiment["planner"],
            perception=experiment["perception"],
            sensors=experiment["sensors"],
            faults=experiment["fault"],
            **experiment.replaced(population=(population,)).changes,
        )
    )


def about_run(experiment: Experiment, command: str, out: Path, **more: Any) -> dict[str, Any]:
    """Return a command and its settings for ``run.json``; resuming a run gives the same."""
    settings = experiment.settings(**more)
    words = ["awarenav", *command.split(), *option_words(settings), "--out", str(out)]
    return {"command": shlex.join(words), "settings": settings}


def job_of(scenario_text: str, policy: tuple[str, str], planner: str, **axes: Any) -> Job:
    """Return the job of a scenario whose conditions are already in it.

    Args:
        scenario_text: YAML of a :class:`Scenario`.
        policy: its name in tables, and its YAML.
        planner: ``"module:Class"``, or empty for the reference planner.
        axes: ``seed`` and ``perception``, as fields of a job.
    """
    scenario = scenario_of(scenario_text)
    return Job(
        scenario=scenario.name,
        policy=policy[0],
        planner=planner_label(planner, scenario),
        **axes,
        scenario_text=scenario_text,
        policy_text=policy[1],
        planner_text=planner,
    )


def named_scenarios(names: Sequence[str], **axes: str) -> tuple[Scenario, ...]:
    """Return the scenarios of names and YAML files, each once.

    Args:
        names: shipped names, YAML files, or sets (:data:`SCENARIO_SETS`)
            without the scenarios that need no planner.
        axes: as for :func:`plan_jobs`.

    Raises:
        SimError: an unknown name, an unusable file, camera or robot, or two scenarios of one name.
    """
    found: dict[str, Scenario] = {}
    for scenario in _expanded(names, axes):
        if found.setdefault(scenario.name, scenario) != scenario:
            raise SimError(f"two scenarios are called {scenario.name!r}; give them other names")
    return tuple(found.values())


@lru_cache(maxsize=256)
def scenario_of(text: str) -> Scenario:
    """Return the scenario of a job; raise SimError for YAML that holds none."""
    return Scenario.from_text(text)


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


def _expanded(scenarios: Iterable[str | Scenario], axes: Mapping[str, str]) -> list[Scenario]:
    """Return the scenarios of names and files, as camera, robot and population change them."""
    found: list[Scenario] = []
    for each in scenarios:
        if isinstance(each, Scenario):
            found.append(each)
        elif each in SCENARIO_SETS:
            found += [
                scenario
                for scenario in map(Scenario.shipped, shipped_scenarios(each))
                if scenario.robot.straight_on_speed_mps is None
            ]
        else:
            found.append(Scenario.named(each))
    return [changed_scenario(each, axes) for each in found]


def _named_policy(
    policy: str | tuple[str, AwarenessPolicy], perceptions: Sequence[str]
) -> list[tuple[str, str, str]]:
    """Return the name and the YAML of a policy with each perception; the oracle has its own."""
    if policy == ORACLE:
        return [(ORACLE, policy_text(AwarenessPolicy.preset("balanced")), ORACLE)]
    name, own_policy = named_policy(policy) if isinstance(policy, str) else policy
    text = policy_text(own_policy)
    return [(name, text, perception) for perception in perceptions]


def _matching_faults(given: str | Fault) -> list[str | Fault]:
    """Return the shipped faults that a pattern stands for; anything else as it is."""
    if not isinstance(given, str) or not _PATTERN.search(given) or Path(given).exists():
        return [given]
    parts = [fnmatch.filter(shipped_faults(), part) for part in given.split("+")]
    names: list[str | Fault] = ["+".join(each) for each in itertools.product(*parts)]
    if not names:
        raise SimError(
            f"no shipped fault fits the pattern {given!r}; they are {', '.join(shipped_faults())}"
        )
    return names


def _named_fault(fault: str | Fault) -> tuple[str, str]:
    """Return the name and the YAML of a fault, both empty for none."""
    if isinstance(fault, str):
        if fault in ("", NO_FAULT):
            return "", ""
        fault = Fault.of(fault)
    if fault.name == NO_FAULT:
        raise SimError(f"a fault must have a name of its own, got {fault.name!r}")
    return fault.name, fault.to_text()


def sample_jobs(jobs: Sequence[Job], count: int, seed: int = 0) -> tuple[Job, ...]:
    """Return some of the jobs, drawn at random and in the order of the plan.

    Faults are drawn in rounds: each once, in random order, before any is drawn again. Within the
    jobs of a fault, those come first whose scenario, then whose policy, planner and perception,
    were drawn least. Otherwise chance decides. A smaller sample with the same seed is part of a
    larger one.
    """
    number = finite_number("sample", count, SimError, minimum=1, maximum=len(jobs))
    if number != int(number):
        raise SimError(f"sample must be a whole number of episodes, got {count!r}")
    rng = np.random.default_rng([seed, _STREAM])
    left: dict[str, list[int]] = {}
    for row in rng.permutation(len(jobs)).tolist():
        left.setdefault(jobs[row].fault, []).append(row)
    faults = sorted(left)
    scenarios: Counter[str] = Counter()
    variants: Counter[tuple[str, str, str]] = Counter()
    drawn: list[int] = []
    while len(drawn) < number:
        for place in rng.permutation(len(faults)).tolist():
            rows = left[faults[place]]
            if not rows:
                continue
            row = min(
                rows, key=lambda r: (scenarios[jobs[r].scenario], variants[_variant(jobs[r])])
            )
            rows.remove(row)
            scenarios[jobs[row].scenario] += 1
            variants[_variant(jobs[row])] += 1
            drawn.append(row)
    return tuple(jobs[row] for row in sorted(drawn[: int(number)]))


def _variant(job: Job) -> tuple[str, str, str]:
    return job.policy, job.planner_text, job.perception
