"""A planner's scorecard: local planners compared on the same crossings, on one page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._compare import compare_planners, write_scorecard
    from ._score import (
        FieldUse,
        Obedience,
        PlannerScore,
        PlanTime,
        RadiiUse,
        Score,
        Scorecard,
    )
    from ._scoring import read_scorecard

__all__ = [
    "FieldUse",
    "Obedience",
    "PlanTime",
    "PlannerScore",
    "RadiiUse",
    "Score",
    "Scorecard",
    "compare_planners",
    "read_scorecard",
    "write_scorecard",
]

__getattr__ = lazy_page(__name__, __file__)
