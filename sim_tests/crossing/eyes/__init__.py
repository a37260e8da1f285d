"""Perception of people in a crossing: the truth, simulated keypoints, pixels, or laser scans."""

from __future__ import annotations

from ._camera_eyes import Exposure, Eyes, MapView, SurroundEyes, TimedEyes, TrueEyes
from ._keypoint_camera import KeypointCamera, KeypointNoise
from ._make_eyes import make_eyes
from ._messages import (
    NOBODY,
    Change,
    Delivery,
    MountedScan,
    OdometryReading,
    Sighting,
    WorkerObservations,
)
from ._pixel_eyes import PIXEL_RATE_HZ, PixelEyes, match_to_workers, pixel_timing
from ._scanner_eyes import ScannerEyes, hall_grid, motion_of, scanner_sensors

__all__ = [
    "NOBODY",
    "PIXEL_RATE_HZ",
    "Change",
    "Delivery",
    "Exposure",
    "Eyes",
    "KeypointCamera",
    "KeypointNoise",
    "MapView",
    "MountedScan",
    "OdometryReading",
    "PixelEyes",
    "ScannerEyes",
    "Sighting",
    "SurroundEyes",
    "TimedEyes",
    "TrueEyes",
    "WorkerObservations",
    "hall_grid",
    "make_eyes",
    "match_to_workers",
    "motion_of",
    "pixel_timing",
    "scanner_sensors",
]
