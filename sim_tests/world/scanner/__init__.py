"""Simulated laser scanners: rays cast against the surfaces of hall, people, carts and robot."""

from __future__ import annotations

from ._scene import ScanScene
from ._simulated_scanner import SimulatedScanner, scan_all
from ._spec import DIAGONAL_SCANNERS, ScannerSpec

__all__ = [
    "DIAGONAL_SCANNERS",
    "ScanScene",
    "ScannerSpec",
    "SimulatedScanner",
    "scan_all",
]
