"""How the robot perceives people in a crossing: truth, simulated keypoints, or pixels."""

from __future__ import annotations

from ._eyes import ORACLE, MapView, PerceptionKind, Sighting, TimedEyes, make_eyes
from ._keypoint_camera import KeypointNoise
from ._pixel_eyes import NOBODY, PIXEL_RATE_HZ, pixel_timing

__all__ = [
    "NOBODY",
    "ORACLE",
    "PIXEL_RATE_HZ",
    "KeypointNoise",
    "MapView",
    "PerceptionKind",
    "Sighting",
    "TimedEyes",
    "make_eyes",
    "pixel_timing",
]
