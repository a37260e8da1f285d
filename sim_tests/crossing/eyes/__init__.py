"""Perception of people in a crossing: the truth, simulated keypoints, or pixels."""

from __future__ import annotations

from ._eyes import NOBODY, Eyes, Sighting, SurroundEyes, TimedEyes, WorkerObservations
from ._keypoint_camera import KeypointCamera, KeypointNoise
from ._make_eyes import make_eyes
from ._map_view import MapView
from ._pixel_eyes import PIXEL_RATE_HZ, PixelEyes, match_to_workers, pixel_timing
from ._scanner_eyes import ScanChange, ScannerEyes, known_motion, scanner_sensors
from ._true_eyes import TrueEyes

__all__ = [
    "NOBODY",
    "PIXEL_RATE_HZ",
    "Eyes",
    "KeypointCamera",
    "KeypointNoise",
    "MapView",
    "PixelEyes",
    "ScanChange",
    "ScannerEyes",
    "Sighting",
    "SurroundEyes",
    "TimedEyes",
    "TrueEyes",
    "WorkerObservations",
    "known_motion",
    "make_eyes",
    "match_to_workers",
    "pixel_timing",
    "scanner_sensors",
]
