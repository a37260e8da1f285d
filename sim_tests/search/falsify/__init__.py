"""The situations in which a policy does worst, found by optimisation: ``awarenav falsify``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._no_floor_planner import NoFloorPlanner
    from ._results import run_falsify

__getattr__ = lazy_page(__name__, __file__)
