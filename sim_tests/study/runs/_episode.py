"""One episode from its job to its record; an error becomes part of the record."""

from __future__ import annotations

from dataclasses import dataclass, replace
from traceback import format_exc
from typing import Final

from perception.networks import OnnxSettings

from ...crossing import CrossingResult, Observer
from ...crossing.eyes import Perception, pixel_pipeline
from ...world.errors import SimError
from ..measures import Conduct, EpisodeRecord, measure
from ._job import Job
from ._plan import fault_of, job_key, policy_of, template_of
from ._planner_choice import planner_label
from ._seeded_crossing import FreeRun, free_run, seeded_crossing

# An episode runs on one core, beside others.
_ONE_CORE: Final = OnnxSettings(intra_op_threads=1)


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


def run_episode(job: Job) -> EpisodeRecord:
    """Run and measure one episode; an exception becomes ``error`` of the record.

    The same job gives the same record, in every process and after any other jobs.
    """
    return attempt(job).record


def attempt(job: Job) -> Attempt:
    """Run and measure one episode; only an interruption is raised."""
    try:
        result, record = observed_episode(job)
        return Attempt(record, conduct=Conduct.of(result))
    except Exception as error:  # a planner may raise anything, and the run continues
        return failed(job, f"{type(error).__name__}: {error}", format_exc())


def observed_episode(
    job: Job, observer: Observer | None = None
) -> tuple[CrossingResult, EpisodeRecord]:
    """Run and measure one episode, watched by ``observer``; exceptions are raised."""
    template, fault = template_of(job.scenario), fault_of(job.fault)
    scenario, senses = template.for_seed(job.seed), Perception.named(job.perception)
    # Before the episode: what a planner imports only while it drives is then there.
    free = free_run_of(job)
    result = seeded_crossing(
        scenario,
        job.planner,
        job.seed,
        observer=observer,
        policy=policy_of(job.policy),
        perception=job.perception,
        fault=fault,
        pipeline=pixel_pipeline(scenario, onnx_settings=_ONE_CORE)
        if senses.kind == "pixels"
        else None,
    )
    record = measure(
        result,
        time_without_people_s=free.time_s,
        length_without_people_m=free.length_m,
        scenario_version=template.version,
        attention=template.attention,
        fault=job.fault_name,
    )
    return result, replace(
        record,
        policy=job.policy_name,
        planner=planner_label(job.planner, scenario),
        nondeterministic=not free.repeats,
    )


def free_run_of(job: Job) -> FreeRun:
    """Return the figures of a job's task without people; unknown for a robot without a planner."""
    scenario = template_of(job.scenario).for_seed(job.seed)
    if not job.planner and scenario.robot.straight_on_speed_mps is not None:
        return FreeRun(None, None, repeats=True)
    return free_run(scenario.without_people().model_dump_json(), job.planner)


def failed(job: Job, error: str, traceback: str = "") -> Attempt:
    """Return the record of an episode without a result."""
    try:
        key = job_key(job)
    except SimError:  # the scenario cannot be read
        planner = job.planner.rpartition(":")[2]
        record = EpisodeRecord("", job.seed, job.policy_name, planner, job.perception)
        return Attempt(replace(record, fault=job.fault_name, error=_error_text(error)), traceback)
    template = template_of(job.scenario)
    record = EpisodeRecord(
        **key._asdict(),
        scenario_version=template.version,
        attention=template.attention,
        error=_error_text(error),
    )
    return Attempt(record, traceback)


def _error_text(error: str) -> str:
    """Return an error as it is read back from the table, where an episode is one line."""
    return " ".join(error.replace("\0", "").splitlines())[:500]
