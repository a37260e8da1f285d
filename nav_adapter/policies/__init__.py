"""The parts of an awareness policy. The presets are YAML files in this folder."""

from __future__ import annotations

from ._awareness import (
    InflationPolicy,
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    SpeedPolicy,
)
from ._settings import AlertRules, ReachRules, SafetyMargins, TimeBehaviour

__all__ = [
    "AlertRules",
    "InflationPolicy",
    "InterpolatedHumanSpeed",
    "InterpolatedInflation",
    "ReachRules",
    "SafetyMargins",
    "SpeedPolicy",
    "TimeBehaviour",
]
