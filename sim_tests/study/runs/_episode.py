"""One episode from its job to its record; an error becomes part of the record."""

from __future__ import annotations

import faulthandler
import signal
from dataclasses import dataclass, replace
from functools import lru_cache
from traceback import format_exc
from typing import Any, Final

import numpy as np

from perception.networks import OnnxSettings

from ...crossing import CrossingResult, Observer, run_crossing
from ...crossing.eyes import Perception, pixel_pipeline
from ...scenario import Scenario
from ...world.errors import SimError
from ..measures import Conduct, EpisodeRecord, measure, path_length_m
from ._job import Attempt, Job
from ._plan import fault_of, job_key, policy_of, template_of
from ._planner_choice import import_planner, make_planner, planner_label, seeded_generators

# Seed of the planner in the task without people, the same for every episode of the task.
_FREE_SEED: Final = 0
# A planner that does not come back from compiled code cannot be interrupted. Its process is ended
# this long after the limit.
_GRACE_S: Final = 5.0
# An episode runs on one core, beside others.
_ONE_CORE: Final = OnnxSettings(intra_op_threads=1)


@dataclass(frozen=True, slots=True)
class FreeRun:
    """A task driven without people and without a fault.

    Attributes:
        time_s: time to goal; None if the goal was not reached.
        length_m: length of the driven path; None likewise.
        repeats: False if the user's planner gave other commands the second time, with the same
            seed. The reference planner is deterministic and drives only once.
    """

    time_s: float | None
    length_m: float | None
    repeats: bool


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


class _TimeLimit(BaseException):
    """An episode took too long; no planner catches it by ``except Exception``."""


def attempt_within(limit_s: float, job: Job) -> Attempt:
    """Run and measure one episode as :func:`attempt`, in a process of its own, and end it in time.

    Args:
        limit_s: wall-clock limit.
        job: the episode.
    """

    def end(*_: object) -> None:
        raise _TimeLimit

    faulthandler.dump_traceback_later(limit_s + _GRACE_S, exit=True)
    try:
        if hasattr(signal, "setitimer"):  # not on Windows
            signal.signal(signal.SIGALRM, end)
            signal.setitimer(signal.ITIMER_REAL, limit_s)
        return attempt(job)
    except _TimeLimit:
        return failed(job, f"TimeLimit: ended after the time limit of {limit_s:g} s", format_exc())
    finally:
        faulthandler.cancel_dump_traceback_later()
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)


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


def died(job: Job, reason: str) -> Attempt:
    """Return the record of an episode that killed its process, for :func:`in_parallel`."""
    return failed(job, f"WorkerDied: {reason}", reason)


def _error_text(error: str) -> str:
    """Return an error as it is read back from the table, where an episode is one line."""
    return " ".join(error.replace("\0", "").splitlines())[:500]


def seeded_crossing(
    scenario: Scenario,
    planner: str,
    seed: int,
    *,
    observer: Observer | None = None,
    **options: Any,
) -> CrossingResult:
    """Run a crossing with a new planner, with the global random generators seeded.

    Args:
        scenario: the scenario.
        planner: ``"module:Class"``, or empty for the default planner.
        seed: seed of the crossing, the planner and the generators.
        observer: as for :func:`run_crossing`.
        options: further arguments of :func:`run_crossing`.
    """
    if planner:
        import_planner(planner)  # before seeding: a module may draw where it begins
    with seeded_generators(seed):
        own = make_planner(planner, scenario, seed)
        return run_crossing(scenario, planner=own, seed=seed, observer=observer, **options)


# Cached, because one process runs many episodes of few tasks.
@lru_cache(maxsize=4096)
def free_run(task: str, planner: str) -> FreeRun:
    """Return the figures of a task without people: JSON of a :class:`Scenario`.

    A planner of the user's drives it twice, and both must give the same commands in every cycle.
    """
    scenario = Scenario.model_validate_json(task)
    first = seeded_crossing(scenario, planner, _FREE_SEED, policy="balanced")
    repeats = True
    if planner:
        second = seeded_crossing(scenario, planner, _FREE_SEED, policy="balanced")
        repeats = _commands(first) == _commands(second)
    if first.time_to_goal_s is None:
        return FreeRun(None, None, repeats)
    path_m = np.array([frame.robot_state.position_odom_m for frame in first.frames])
    return FreeRun(first.time_to_goal_s, path_length_m(path_m), repeats)


def _commands(result: CrossingResult) -> list[tuple[float, float]]:
    return [frame.command for frame in result.frames]
