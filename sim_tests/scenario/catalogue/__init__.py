"""The shipped scenarios listed, described, drawn and checked: ``awarenav scenario``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._checks import CHECKED_DRAWS, scenario_problems, template_problems
    from ._plans import CONFLICT_M, approach_statistics, closest_approaches, person_plan, robot_plan

__all__ = [
    "CHECKED_DRAWS",
    "CONFLICT_M",
    "approach_statistics",
    "closest_approaches",
    "person_plan",
    "robot_plan",
    "scenario_problems",
    "template_problems",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._checks": (
            "CHECKED_DRAWS",
            "scenario_problems",
            "template_problems",
        ),
        "._plans": (
            "CONFLICT_M",
            "approach_statistics",
            "closest_approaches",
            "person_plan",
            "robot_plan",
        ),
    },
)
