"""Simulated laser scanners: rays cast against the surfaces of hall, people, carts and robot."""

from __future__ import annotations

from ._scanner import DIAGONAL_SCANNERS, ScannerSpec, SimulatedScanner, scan_all
from ._scene import ScanScene
