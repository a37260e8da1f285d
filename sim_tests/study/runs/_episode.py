"""One episode from its job to its record; an error becomes part of the record."""

from __future__ import annotations

import faulthandler
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from functools import lru_cache
from traceback import format_exc
from typing import Final

from ...crossing import CrossingResult, Observer, Setup, drive
from ...crossing.planner import is_outside
from ...scenario import Scenario
from ...world.errors import SimError
from ..measures import Conduct, EpisodeRecord, measure, path_length_m
from ._plan import fault_of, policy_of, scenario_of
from ._run_files import Attempt, Job

# Seed of the planner in the task without people, the same for every episode of the task.
_FREE_SEED: Final = 0
_FREE_POLICY: Final = "balanced"
# A planner that does not come back from compiled code cannot be interrupted. Its process is ended
# this long after the limit.
_GRACE_S: Final = 5.0


def run_episode(job: Job) -> EpisodeRecord:
    """Run and measure one episode; an exception becomes ``error`` of the record.

    The same job gives the same record, in every process and after any other jobs.
    """
    return attempt(job).record


def attempt(
    job: Job, free: EpisodeRecord | None = None, *, limit_s: float | None = None
) -> Attempt:
    """Run and measure one episode; only an interruption is raised.

    Args:
        job: the episode.
        free: the row of its task without people; None drives that too.
        limit_s: wall-clock limit, in a process that runs nothing else; None for no limit.
    """
    try:
        with _ended_after(limit_s):
            result, record = observed_episode(job, free=free)
            return Attempt(record, conduct=Conduct.of(result))
    except _TimeLimit:
        return failed(job, f"TimeLimit: ended after the time limit of {limit_s:g} s", format_exc())
    except Exception as error:  # a planner may raise anything, and the run continues
        return failed(job, f"{type(error).__name__}: {error}", format_exc())


class _TimeLimit(BaseException):
    """An episode took too long; no planner catches it by ``except Exception``."""


@contextmanager
def _ended_after(limit_s: float | None) -> Iterator[None]:
    """Raise :class:`_TimeLimit` in the block, or end the process if it does not come back."""
    if limit_s is None:
        yield
        return

    def end(*_: object) -> None:
        raise _TimeLimit

    faulthandler.dump_traceback_later(limit_s + _GRACE_S, exit=True)
    try:
        if hasattr(signal, "setitimer"):  # not on Windows
            signal.signal(signal.SIGALRM, end)
            signal.setitimer(signal.ITIMER_REAL, limit_s)
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)


def observed_episode(
    job: Job, observer: Observer | None = None, *, free: EpisodeRecord | None = None
) -> tuple[CrossingResult, EpisodeRecord]:
    """Run and measure one episode, watched by ``observer``; exceptions are raised.

    ``free`` is the row of its task without people; None drives that too.
    """
    scenario = scenario_of(job.scenario_text)
    # Before the episode: what a planner imports only while it drives is then there.
    free = free_run_of(job) if free is None else free
    result = replace(
        drive(setup_of(job), observer),
        time_without_people_s=free.time_to_goal_s,
        length_without_people_m=free.path_length_m,
    )
    record = measure(
        result,
        scenario_version=scenario.version,
        attention=scenario.attention,
        nondeterministic=free.nondeterministic,
        **asdict(job.conditions),
    )
    return result, record


def setup_of(job: Job) -> Setup:
    """Return the episode of a job; raise SimError for a job that cannot be read."""
    return Setup(
        conditions=job.conditions,
        scenario=scenario_of(job.scenario_text).draw(job.seed),
        policy=policy_of(job.policy_text),
        planner=job.planner_text,
        fault=fault_of(job.fault_text),
    )


def task_of(job: Job) -> tuple[str, int, str]:
    """Return the key of a job's task without people: jobs with the same key share it."""
    try:
        distributions = scenario_of(job.scenario_text).distributions
    except SimError:  # each of its episodes says it
        distributions = {}
    varies = any(path.startswith("robot.") for path in distributions)
    return job.scenario_text, job.seed if varies else 0, job.planner_text


def people_in(job: Job) -> int:
    """Return the number of people in an episode, to which its cost is about proportional."""
    return _people_in(job.scenario_text)


@lru_cache(maxsize=256)
def _people_in(scenario_text: str) -> int:
    try:
        return len(scenario_of(scenario_text).people)
    except SimError:  # its episodes say it
        return 0


def free_run_of(job: Job) -> EpisodeRecord:
    """Return the row of a job's task without people and without a fault.

    It has the time to goal and the path length of a robot that arrived, and ``nondeterministic``;
    nothing of a robot without a planner.
    """
    scenario = scenario_of(job.scenario_text).draw(job.seed)
    if not job.planner_text and scenario.robot.straight_on_speed_mps is not None:
        return EpisodeRecord(**asdict(job.conditions))
    return _free_run(scenario.without_people().model_dump_json(), job.planner_text)


def free_run_or_none(job: Job, *, limit_s: float | None = None) -> EpisodeRecord | None:
    """Return :func:`free_run_of`; None for one that fails, as its episodes will.

    ``limit_s`` is that of :func:`attempt`.
    """
    try:
        with _ended_after(limit_s):
            return free_run_of(job)
    except (_TimeLimit, Exception):  # a planner may raise anything; each episode says it
        return None


def failed(job: Job, error: str, traceback: str = "") -> Attempt:
    """Return the record of an episode without a result."""
    # As it is read back from the table, where an episode is one line.
    line = " ".join(error.replace("\0", "").splitlines())[:500]
    record = EpisodeRecord(**asdict(job.conditions), error=line)
    try:
        scenario = scenario_of(job.scenario_text)
    except SimError:  # the scenario cannot be read
        return Attempt(record, traceback)
    about = {"scenario_version": scenario.version, "attention": scenario.attention}
    return Attempt(replace(record, **about), traceback)


def died(job: Job, reason: str) -> Attempt:
    """Return the record of an episode that killed its process, for :meth:`Workers.results`."""
    return failed(job, f"WorkerDied: {reason}", reason)


# Cached, because one process runs many episodes of few tasks.
@lru_cache(maxsize=4096)
def _free_run(task: str, planner: str) -> EpisodeRecord:
    """Return the row of a task without people: JSON of a :class:`Scenario`.

    A planner of the user's drives it twice, and both must give the same commands in every cycle. A
    stack outside never does, and drives it once. The reference planner is deterministic.
    """
    scenario = Scenario.model_validate_json(task)
    setup = Setup.of(scenario, policy=_FREE_POLICY, planner=planner, seed=_FREE_SEED)
    first = drive(setup)
    repeats = not planner or (
        not is_outside(planner) and _commands(first) == _commands(drive(setup))
    )
    arrived_s = first.time_to_goal_s
    return EpisodeRecord(
        **asdict(setup.conditions),
        time_to_goal_s=arrived_s,
        path_length_m=None if arrived_s is None else path_length_m(first.robot_odom_m),
        nondeterministic=not repeats,
    )


def _commands(result: CrossingResult) -> list[tuple[float, float, float]]:
    return [(*frame.command, frame.lateral_command_mps) for frame in result.frames]
