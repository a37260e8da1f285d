"""Stand-in for sim_tests.runs.run_episode until that branch is merged."""

from __future__ import annotations

import importlib
from dataclasses import replace
from functools import lru_cache

import yaml

from nav_adapter import AwarenessPolicy

from .._crossing import run_crossing
from .._scenario_template import ScenarioTemplate
from .._stage import Stage
from ..measures._episode_record import EpisodeRecord
from ..measures._measure import measure
from ..robot._amr import NOVA_CARTER
from ..runs._job import Job

import numpy as np


def run_episode(job: Job) -> EpisodeRecord:
    try:
        template = ScenarioTemplate.from_text(job.scenario)
        scenario = template.for_seed(job.seed)
        planner = None
        if job.planner:
            module, _, name = job.planner.partition(":")
            with Stage(scenario.without_people(), np.zeros(0)) as stage:
                boxes = stage.warehouse.obstacle_boxes_odom
            planner = getattr(importlib.import_module(module), name)(NOVA_CARTER, boxes)
        result = run_crossing(
            scenario,
            policy=AwarenessPolicy.model_validate(yaml.safe_load(job.policy)),
            planner=planner,
            perception=job.perception,
            seed=job.seed,
        )
        record = measure(
            result,
            time_without_people_s=_alone(scenario.model_copy(update={"name": ""}).model_dump_json()),
            scenario_version=scenario.version,
            attention=scenario.attention,
        )
        return replace(record, policy=job.policy_name)
    except Exception as error:
        return EpisodeRecord("?", job.seed, job.policy_name, job.planner, job.perception, error=str(error))


def _alone(text: str) -> float | None:
    return _alone_of(ScenarioTemplate.from_text(text.replace('"name":""', '"name":"x"')).median().without_people().model_dump_json())


@lru_cache(maxsize=64)
def _alone_of(text: str) -> float | None:
    return run_crossing(ScenarioTemplate.from_text(text).median(), policy="blind").time_to_goal_s
