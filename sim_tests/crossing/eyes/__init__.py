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
