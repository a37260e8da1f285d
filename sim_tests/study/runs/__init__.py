"""Many crossings in parallel, resumable, with results that do not depend on the workers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._episode import Attempt, attempt, free_run_of, observed_episode, run_episode
    from ._job import Job
    from ._plan import (
        JobKey,
        describe,
        fault_of,
        job_key,
        named_templates,
        plan_jobs,
        policy_of,
        policy_text,
        template_of,
    )
    from ._planner_choice import (
        KNOWN_PLANNERS,
        make_planner,
        planner_label,
        planner_parameters,
        refuse_unusable_planner,
    )
    from ._pool import WorkerPool, one_thread_each, run_here, tidy
    from ._process_lock import ProcessLock
    from ._recording import recorder_of
    from ._replay import find_episode
    from ._run import run_jobs
    from ._run_files import RunFiles, read_jobs, read_run
    from ._sample import sample_jobs
    from ._seeded_crossing import seeded_crossing

__all__ = [
    "KNOWN_PLANNERS",
    "Attempt",
    "Job",
    "JobKey",
    "ProcessLock",
    "RunFiles",
    "WorkerPool",
    "attempt",
    "describe",
    "fault_of",
    "find_episode",
    "free_run_of",
    "job_key",
    "make_planner",
    "named_templates",
    "observed_episode",
    "one_thread_each",
    "plan_jobs",
    "planner_label",
    "planner_parameters",
    "policy_of",
    "policy_text",
    "read_jobs",
    "read_run",
    "recorder_of",
    "refuse_unusable_planner",
    "run_episode",
    "run_here",
    "run_jobs",
    "sample_jobs",
    "seeded_crossing",
    "template_of",
    "tidy",
]

__getattr__ = lazy_page(__name__, __file__)
