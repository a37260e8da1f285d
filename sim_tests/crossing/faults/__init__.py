"""Faults of camera, odometry, detections and scanners as data, and their injection."""

from __future__ import annotations

from ._detections import FaultyDetections
from ._fault import Bursts, Fault, Ghosts, shipped_faults
from ._frames import FaultyEyes
from ._injection import FaultInjection
from ._outage import Onset, Outage
from ._scanner_fault import Appearances, BlindSector, ScannerFault
from ._scans import FaultyScans

__all__ = [
    "Appearances",
    "BlindSector",
    "Bursts",
    "Fault",
    "FaultInjection",
    "FaultyDetections",
    "FaultyEyes",
    "FaultyScans",
    "Ghosts",
    "Onset",
    "Outage",
    "ScannerFault",
    "shipped_faults",
]
