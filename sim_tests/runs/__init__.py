"""Many crossings: in parallel, under faults, resumable, the same on any number of workers."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..faults._fault import Fault, shipped_faults
    from ._episode import run_episode
    from ._job import Job
    from ._plan import plan_jobs
    from ._run import run_jobs

__all__ = ["Fault", "Job", "plan_jobs", "run_episode", "run_jobs", "shipped_faults"]

# Imported when first used, so that the command line's help works without the simulator.
_HOMES = {
    "Fault": "sim_tests.faults._fault",
    "Job": "sim_tests.runs._job",
    "plan_jobs": "sim_tests.runs._plan",
    "run_episode": "sim_tests.runs._episode",
    "run_jobs": "sim_tests.runs._run",
    "shipped_faults": "sim_tests.faults._fault",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
