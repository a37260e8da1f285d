"""Local planners: the interface, the reference planner, and one that drives straight ahead."""

from __future__ import annotations

from ._config import PlannerConfig
from ._local_planner import LocalPlanner, StraightOn
from ._sampling_planner import SamplingPlanner

__all__ = [
    "LocalPlanner",
    "PlannerConfig",
    "SamplingPlanner",
    "StraightOn",
]
