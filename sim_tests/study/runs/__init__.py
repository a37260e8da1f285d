"""Many crossings in parallel, resumable, with results that do not depend on the workers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._episode import attempt, observed_episode, run_episode
    from ._job import Job
    from ._plan import JobKey, describe, job_key, plan_jobs, policy_text
    from ._planner_choice import make_planner
    from ._pool import WorkerPool, run_here, tidy
    from ._run import run_jobs
    from ._run_folder import ERRORS

__all__ = [
    "ERRORS",
    "Job",
    "JobKey",
    "WorkerPool",
    "attempt",
    "describe",
    "job_key",
    "make_planner",
    "observed_episode",
    "plan_jobs",
    "policy_text",
    "run_episode",
    "run_here",
    "run_jobs",
    "tidy",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._episode": (
            "attempt",
            "observed_episode",
            "run_episode",
        ),
        "._job": ("Job",),
        "._plan": (
            "JobKey",
            "describe",
            "job_key",
            "plan_jobs",
            "policy_text",
        ),
        "._planner_choice": ("make_planner",),
        "._pool": (
            "WorkerPool",
            "run_here",
            "tidy",
        ),
        "._run": ("run_jobs",),
        "._run_folder": ("ERRORS",),
    },
)
