"""Scenarios listed, described, drawn and checked without a crossing."""

from ._plans import (
    CHECKED_DRAWS,
    CONFLICT_M,
    approach_statistics,
    closest_approaches,
    person_plan,
    robot_plan,
    scenario_problems,
    template_problems,
)
from ._show import list_command, names_of_sets, show_command

__all__ = [
    "CHECKED_DRAWS",
    "CONFLICT_M",
    "approach_statistics",
    "closest_approaches",
    "list_command",
    "names_of_sets",
    "person_plan",
    "robot_plan",
    "scenario_problems",
    "show_command",
    "template_problems",
]
