"""The reference local planner."""

from __future__ import annotations

from ._planner import LocalPlanner, SamplingPlanner

__all__ = [
    "LocalPlanner",
    "SamplingPlanner",
]
