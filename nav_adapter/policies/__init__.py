"""The parts of an awareness policy. The presets are YAML files in this folder."""

from __future__ import annotations

from ._awareness import (
    InflationPolicy,
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    SpeedPolicy,
)
from ._settings import AlertRules, AttentionRules, ReachRules, SafetyMargins, TimeBehaviour

__all__ = [
    "AlertRules",
    "AttentionRules",
    "InflationPolicy",
    "InterpolatedHumanSpeed",
    "InterpolatedInflation",
    "ReachRules",
    "SafetyMargins",
    "SpeedPolicy",
    "TimeBehaviour",
]
