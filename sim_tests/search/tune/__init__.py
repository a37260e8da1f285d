"""Policies tuned for little time lost and little margin violated: ``awarenav tune``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._evaluation import Evaluation, knee, pareto_front
    from ._policy_space import PolicySpace, read_ranges, shipped_ranges
    from ._results import importances
    from ._settings import TuneSettings
    from ._tune import feasible_front

__all__ = [
    "Evaluation",
    "PolicySpace",
    "TuneSettings",
    "feasible_front",
    "importances",
    "knee",
    "pareto_front",
    "read_ranges",
    "shipped_ranges",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._evaluation": (
            "Evaluation",
            "knee",
            "pareto_front",
        ),
        "._policy_space": (
            "PolicySpace",
            "read_ranges",
            "shipped_ranges",
        ),
        "._results": ("importances",),
        "._settings": ("TuneSettings",),
        "._tune": ("feasible_front",),
    },
)
