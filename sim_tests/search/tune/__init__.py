"""Policies tuned for the least time lost at a given risk: ``awarenav tune``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._evaluation import Evaluation
    from ._policy_space import PolicySpace, read_ranges, shipped_ranges
    from ._results import importances
    from ._settings import TuneSettings
    from ._tune import ranked_trials

__all__ = [
    "Evaluation",
    "PolicySpace",
    "TuneSettings",
    "importances",
    "ranked_trials",
    "read_ranges",
    "shipped_ranges",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._evaluation": ("Evaluation",),
        "._policy_space": (
            "PolicySpace",
            "read_ranges",
            "shipped_ranges",
        ),
        "._results": ("importances",),
        "._settings": ("TuneSettings",),
        "._tune": ("ranked_trials",),
    },
)
