"""The parts of an awareness policy. The presets are YAML files in this folder."""

from __future__ import annotations

from ._human_speed import InterpolatedHumanSpeed, SpeedPolicy
from ._inflation import InflationPolicy, InterpolatedInflation, ObstacleOutline
from ._margins import AlertRules, SafetyMargins, TimeBehaviour
from ._speed_rules import (
    DistanceZones,
    NearCap,
    NoticedPeople,
    ProtectiveField,
    SpeedRules,
    StandingPeople,
    StartReserve,
    WalkingPeople,
)
from ._tables import TableHumanSpeed, TableInflation

__all__ = [
    "AlertRules",
    "DistanceZones",
    "InflationPolicy",
    "InterpolatedHumanSpeed",
    "InterpolatedInflation",
    "NearCap",
    "NoticedPeople",
    "ObstacleOutline",
    "ProtectiveField",
    "SafetyMargins",
    "SpeedPolicy",
    "SpeedRules",
    "StandingPeople",
    "StartReserve",
    "TableHumanSpeed",
    "TableInflation",
    "TimeBehaviour",
    "WalkingPeople",
]
