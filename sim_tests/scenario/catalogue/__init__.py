"""Scenarios listed, described, drawn and checked without a crossing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._checks import CHECKED_DRAWS, scenario_problems, template_problems
    from ._plans import CONFLICT_M, approach_statistics, closest_approaches, person_plan, robot_plan
    from ._show import draw_command, list_command, names_of_sets, show_command

__all__ = [
    "CHECKED_DRAWS",
    "CONFLICT_M",
    "approach_statistics",
    "closest_approaches",
    "draw_command",
    "list_command",
    "names_of_sets",
    "person_plan",
    "robot_plan",
    "scenario_problems",
    "show_command",
    "template_problems",
]

__getattr__ = lazy_page(__name__, __file__)
