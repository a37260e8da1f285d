"""The situations in which a policy does worst, found by optimisation: ``awarenav falsify``."""

from __future__ import annotations

from ._no_floor_planner import NoFloorPlanner

__all__ = ["NoFloorPlanner"]
