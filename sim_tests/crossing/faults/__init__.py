"""Faults of camera, odometry and detections as data, and their injection."""

from __future__ import annotations

from ._fault import Fault, shipped_faults
from ._frames import FaultInjection

__all__ = [
    "Fault",
    "FaultInjection",
    "shipped_faults",
]
