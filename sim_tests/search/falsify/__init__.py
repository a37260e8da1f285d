"""The situations in which a policy does worst, found by optimisation: ``awarenav falsify``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._no_floor_planner import NoFloorPlanner

__all__ = ["NoFloorPlanner"]

__getattr__ = lazy_names(__name__, {"._no_floor_planner": ("NoFloorPlanner",)})
