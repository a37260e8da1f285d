"""The situations in which a policy does worst, found by optimisation: ``awarenav falsify``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._falsify import Budget
    from ._no_floor_planner import NoFloorPlanner
    from ._restarted_search import CONTACT_SCORE, NO_MARGIN_SCORE, RestartedSearch, score
    from ._scenario_space import ScenarioSpace
    from ._worst_cases import worst_trials

__all__ = [
    "CONTACT_SCORE",
    "NO_MARGIN_SCORE",
    "Budget",
    "NoFloorPlanner",
    "RestartedSearch",
    "ScenarioSpace",
    "score",
    "worst_trials",
]

__getattr__ = lazy_page(__name__, __file__)
