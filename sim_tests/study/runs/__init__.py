"""Many crossings in parallel, resumable, with results that do not depend on the workers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._episode import attempt, died, free_run_of, observed_episode, run_episode, setup_of
    from ._parallel import Workers, in_parallel, tidy
    from ._plan import (
        about_run,
        experiment_jobs,
        fault_of,
        job_of,
        named_scenarios,
        plan_jobs,
        policy_of,
        policy_text,
        sample_jobs,
        scenario_of,
    )
    from ._replay import box_scale_of, find_episode, recorder_of, replay_command
    from ._run import held, run_jobs, terminated_as_interrupted
    from ._run_files import (
        Attempt,
        Job,
        RunFiles,
        answering_note,
        read_attempts,
        read_jobs,
        read_rows,
        read_run,
    )

__getattr__ = lazy_page(__name__, __file__)
