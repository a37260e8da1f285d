"""A planner's scorecard: local planners compared on the same crossings, on one page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

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

__getattr__ = lazy_names(
    __name__,
    {
        "._compare": (
            "compare_planners",
            "write_scorecard",
        ),
        "._score": (
            "FieldUse",
            "Obedience",
            "PlanTime",
            "PlannerScore",
            "RadiiUse",
            "Score",
            "Scorecard",
        ),
        "._scoring": ("read_scorecard",),
    },
)
