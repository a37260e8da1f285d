"""Many crossings in parallel, resumable, with results that do not depend on the workers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._conditions import Conditions
    from ._episode import (
        attempt,
        died,
        free_run_of,
        observed_episode,
        run_episode,
        seeded_crossing,
    )
    from ._job import Job, describe
    from ._parallel import in_parallel, tidy
    from ._plan import (
        fault_of,
        job_key,
        named_templates,
        plan_jobs,
        policy_of,
        policy_text,
        sample_jobs,
        template_of,
    )
    from ._planner_choice import (
        KNOWN_PLANNERS,
        make_planner,
        refuse_unusable_planner,
    )
    from ._replay import box_scale_of, find_episode, recorder_of
    from ._run import run_jobs
    from ._run_files import (
        RunFiles,
        answering_note,
        read_attempts,
        read_jobs,
        read_rows,
        read_run,
    )

__all__ = [
    "KNOWN_PLANNERS",
    "Conditions",
    "Job",
    "RunFiles",
    "answering_note",
    "attempt",
    "box_scale_of",
    "describe",
    "died",
    "fault_of",
    "find_episode",
    "free_run_of",
    "in_parallel",
    "job_key",
    "make_planner",
    "named_templates",
    "observed_episode",
    "plan_jobs",
    "policy_of",
    "policy_text",
    "read_attempts",
    "read_jobs",
    "read_rows",
    "read_run",
    "recorder_of",
    "refuse_unusable_planner",
    "run_episode",
    "run_jobs",
    "sample_jobs",
    "seeded_crossing",
    "template_of",
    "tidy",
]

__getattr__ = lazy_page(__name__, __file__)
