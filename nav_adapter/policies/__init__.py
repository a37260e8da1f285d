"""The parts of an awareness policy, and the presets (YAML files in this folder)."""

from __future__ import annotations

from ._human_speed import InterpolatedHumanSpeed, SpeedPolicy
from ._inflation import InflationPolicy, InterpolatedInflation
from ._margins import SafetyMargins
from ._timing import TimeBehaviour

__all__ = [
    "InflationPolicy",
    "InterpolatedHumanSpeed",
    "InterpolatedInflation",
    "SafetyMargins",
    "SpeedPolicy",
    "TimeBehaviour",
]
