"""Our tracker, norfair, Stone Soup and a naive tracker on the same simulated walkers."""

from __future__ import annotations

from ._consistency import Consistency, on_own_model, on_walkers, white_acceleration_walk
from ._contender import Contender, run
from ._judges import GATE_M, TrackedFrame, TrackingScores, judge
from ._measurements import OCCLUDED, OPEN, SensorSettings, SimulatedRecording, record
from ._walkers import WalkerSettings, walk

__all__ = [
    "GATE_M",
    "OCCLUDED",
    "OPEN",
    "Consistency",
    "Contender",
    "SensorSettings",
    "SimulatedRecording",
    "TrackedFrame",
    "TrackingScores",
    "WalkerSettings",
    "judge",
    "on_own_model",
    "on_walkers",
    "record",
    "run",
    "walk",
    "white_acceleration_walk",
]
