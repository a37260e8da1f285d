"""One row of the comparison of robots in the same aisle, and the time that a robot loses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ..crossing import CrossingResult
from ..scenario import Scenario
from ._camera_film import CameraPicture

#: Policies that ignore awareness: α says nothing about what the robot does.
WITHOUT_AWARENESS: Final = ("blind", "scanner")


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One row of the comparison."""

    label: str
    result: CrossingResult
    scenario: Scenario
    pictures: tuple[CameraPicture, ...] = ()


def time_lost_s(result: CrossingResult, free: CrossingResult) -> float | None:
    """Return how much later a robot arrives than with nobody there; None if one never arrives."""
    if result.time_to_goal_s is None or free.time_to_goal_s is None:
        return None
    return result.time_to_goal_s - free.time_to_goal_s
