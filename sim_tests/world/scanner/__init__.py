"""Simulated laser scanners: rays cast against the surfaces of hall, people, carts and robot."""

from __future__ import annotations

from ._ray_cast import RayHits, cast_rays
from ._scene import ScanScene
from ._simulated_scanner import SimulatedScanner
from ._spec import DIAGONAL_SCANNERS, ScannerSpec

__all__ = [
    "DIAGONAL_SCANNERS",
    "RayHits",
    "ScanScene",
    "ScannerSpec",
    "SimulatedScanner",
    "cast_rays",
]
