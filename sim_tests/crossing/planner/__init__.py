"""Local planners: the interface, the reference planner, one with a costmap, one straight ahead."""

from __future__ import annotations

from ._config import PlannerConfig
from ._local_planner import CostmapPlanner, LocalPlanner, StraightOn
from ._sampling_planner import SamplingPlanner

__all__ = [
    "CostmapPlanner",
    "LocalPlanner",
    "PlannerConfig",
    "SamplingPlanner",
    "StraightOn",
]
