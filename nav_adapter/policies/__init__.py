"""The parts of an awareness policy, and the presets (YAML files in this folder)."""

from __future__ import annotations

from ._alert_rules import AlertRules
from ._distance_zones import DistanceZones
from ._human_speed import InterpolatedHumanSpeed, SpeedPolicy
from ._inflation import InflationPolicy, InterpolatedInflation
from ._margins import SafetyMargins
from ._near_cap import NearCap
from ._outline import ObstacleOutline
from ._speed_rules import SpeedRules
from ._table_human_speed import TableHumanSpeed
from ._table_inflation import TableInflation
from ._timing import TimeBehaviour

__all__ = [
    "AlertRules",
    "DistanceZones",
    "InflationPolicy",
    "InterpolatedHumanSpeed",
    "InterpolatedInflation",
    "NearCap",
    "ObstacleOutline",
    "SafetyMargins",
    "SpeedPolicy",
    "SpeedRules",
    "TableHumanSpeed",
    "TableInflation",
    "TimeBehaviour",
]
