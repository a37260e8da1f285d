"""Cost of the adapter and its exporters, against the same costmap painted with shapely."""

from __future__ import annotations

from ._cli import main
from ._cost import CYCLE, cost_ms
from ._crowd import CELLS, ORIGIN_ODOM_M, RESOLUTION_M, ROBOT, crowd, robot_at
from ._field import field_ms
from ._naive import paint_naively

__all__ = [
    "CELLS",
    "CYCLE",
    "ORIGIN_ODOM_M",
    "RESOLUTION_M",
    "ROBOT",
    "cost_ms",
    "crowd",
    "field_ms",
    "main",
    "paint_naively",
    "robot_at",
]
