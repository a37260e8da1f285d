"""Trackers on the same walkers, ours among them: ``python -m benchmarks.tracking``."""

from __future__ import annotations

from ._judges import GATE_M, TrackedFrame, judge
from ._measurements import OCCLUDED, OPEN, SimulatedRecording, record
from ._walkers import side_m, walk

__all__ = [
    "GATE_M",
    "OCCLUDED",
    "OPEN",
    "SimulatedRecording",
    "TrackedFrame",
    "judge",
    "record",
    "side_m",
    "walk",
]
