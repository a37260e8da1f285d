"""The shipped scenarios listed, described, drawn and checked: ``awarenav scenario``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._checks import scenario_problems, template_problems
    from ._plans import approach_statistics, closest_approaches, person_plan, robot_plan

__all__ = [
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
            "scenario_problems",
            "template_problems",
        ),
        "._plans": (
            "approach_statistics",
            "closest_approaches",
            "person_plan",
            "robot_plan",
        ),
    },
)
