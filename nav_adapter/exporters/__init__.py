"""Exporters: constraints in the forms that planners read, in the odom frame.

Each form has one pure function of :class:`nav_adapter.NavConstraints`; only :class:`CostmapPainter`
keeps state.
``docs/planners.md`` says which planner reads which form, and what to do with a robot that is inside
an obstacle already ("Inside a circle").
"""

from __future__ import annotations

from ._cost import people_cost
from ._costmap import CostmapPainter, paint_costmap
from ._horizon import predicted_circles
from ._shapes import boxes, circles, points, polygons
from ._speed_field import speed_limit_at, time_cost
from ._speed_map import SpeedMap
from ._velocity import half_planes

__all__ = [
    "CostmapPainter",
    "SpeedMap",
    "boxes",
    "circles",
    "half_planes",
    "paint_costmap",
    "people_cost",
    "points",
    "polygons",
    "predicted_circles",
    "speed_limit_at",
    "time_cost",
]
