"""Faults of camera, odometry and detections as data, and their injection into an episode."""

from __future__ import annotations

from ._detections import FaultyDetections
from ._fault import Bursts, Fault, Ghosts, Outage, shipped_faults
from ._frames import FaultyEyes
from ._injection import FaultInjection

__all__ = [
    "Bursts",
    "Fault",
    "FaultInjection",
    "FaultyDetections",
    "FaultyEyes",
    "Ghosts",
    "Outage",
    "shipped_faults",
]
