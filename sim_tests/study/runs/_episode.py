"""One episode from beginning to end, whatever happens in it."""

from __future__ import annotations

import contextlib
import random
import traceback
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from perception import AttentionCone, AwarenessPipeline
from perception.networks import OnnxSettings

from ...crossing import CrossingResult, Observer, run_crossing
from ...scenario import CameraSpec, Scenario
from ...world.errors import SimError
from ..measures import EpisodeRecord, measure, path_length_m
from ._job import Job
from ._plan import fault_of, job_key, policy_of, template_of
from ._planner_choice import make_planner, planner_label


@dataclass(frozen=True, slots=True)
class Attempt:
    """What came of an episode, and the traceback of what went wrong (empty if nothing did)."""

    record: EpisodeRecord
    trace: str = ""


def run_episode(job: Job) -> EpisodeRecord:
    """Run and measure one episode; what goes wrong in it is said in ``error``.

    The same job gives the same record, in whatever process and after whatever else.
    """
    return attempt(job).record


def attempt(job: Job) -> Attempt:
    """Run and measure one episode; nothing but an interruption is raised."""
    try:
        return Attempt(observed_episode(job)[1])
    except Exception as error:  # a planner may raise anything, and the other episodes go on
        return failed(job, f"{type(error).__name__}: {error}", traceback.format_exc())


def observed_episode(
    job: Job, observer: Observer | None = None
) -> tuple[CrossingResult, EpisodeRecord]:
    """Run and measure one episode, watched by ``observer``; whatever goes wrong is raised."""
    template, fault = template_of(job.scenario), fault_of(job.fault)
    scenario = template.for_seed(job.seed)
    with _own_chance(job.seed):
        result = run_crossing(
            scenario,
            policy=policy_of(job.policy),
            planner=make_planner(job.planner, scenario),
            perception=job.perception,
            seed=job.seed,
            observer=observer,
            fault=fault,
            pipeline=_pipeline(scenario.camera) if job.perception == "pixels" else None,
        )
    time_s, length_m = (None, None)
    if scenario.robot.straight_on_speed_mps is None:
        time_s, length_m = _without_people(_task_text(scenario), job.planner)
    record = measure(
        result,
        time_without_people_s=time_s,
        length_without_people_m=length_m,
        scenario_version=template.version,
        attention=template.attention,
        fault=job.fault_name,
    )
    label = planner_label(job.planner, scenario)
    return result, replace(record, policy=job.policy_name, planner=label)


def failed(job: Job, error: str, trace: str = "") -> Attempt:
    """What to say of an episode without a result."""
    try:
        key = job_key(job)
    except SimError:  # not even the scenario can be read
        planner = job.planner.rpartition(":")[2]
        record = EpisodeRecord("", job.seed, job.policy_name, planner, job.perception)
        return Attempt(replace(record, fault=job.fault_name, error=_line(error)), trace)
    template = template_of(job.scenario)
    record = EpisodeRecord(
        scenario=key.scenario,
        seed=key.seed,
        policy=key.policy,
        planner=key.planner,
        perception=key.perception,
        scenario_version=template.version,
        attention=template.attention,
        fault=key.fault,
        error=_line(error),
    )
    return Attempt(record, trace)


def _line(error: str) -> str:
    """As it will be read back from the table, where an episode is a line."""
    return " ".join(error.replace("\0", "").splitlines())[:500]


def _task_text(scenario: Scenario) -> str:
    return scenario.without_people().model_dump_json()


# Networks load once a process, and run on the one core that an episode has.
@lru_cache(maxsize=4)
def _pipeline(camera: CameraSpec) -> AwarenessPipeline:
    """What pixels go through, as :class:`~sim_tests.crossing.eyes.PixelEyes` makes it itself."""
    return AwarenessPipeline(
        camera.camera(camera.picture_scale),
        cone=AttentionCone(),
        eye_in_head_std_rad=0.0,
        onnx_settings=OnnxSettings(intra_op_threads=1),
    )


# One process runs many episodes of few tasks.
@lru_cache(maxsize=4096)
def _without_people(task: str, planner: str) -> tuple[float | None, float | None]:
    """Time to goal and way driven when nobody is there and nothing is wrong."""
    scenario = Scenario.model_validate_json(task)
    with _own_chance(0):
        result = run_crossing(scenario, policy="balanced", planner=make_planner(planner, scenario))
    if result.time_to_goal_s is None:
        return None, None
    way = np.array([frame.robot_state.position_odom_m for frame in result.frames])
    return result.time_to_goal_s, path_length_m(way)


@contextlib.contextmanager
def _own_chance(seed: int) -> Iterator[None]:
    """Seed the global generators, which a planner may draw from; afterwards they are as before."""
    theirs, numpys = random.getstate(), np.random.get_state()  # noqa: NPY002 - planners use it
    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002
    try:
        yield
    finally:
        random.setstate(theirs)
        np.random.set_state(numpys)  # noqa: NPY002
