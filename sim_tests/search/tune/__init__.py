"""Policies tuned for the least time lost at a given risk: ``awarenav tune``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

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

__getattr__ = lazy_page(__name__, __file__)
