"""Everything that runs a network: sessions, person detectors and body poses; heads in ``heads``."""

from __future__ import annotations

from ._detector import OnnxPersonDetector
from ._mediapipe import MediaPipePoseEstimator
from ._pose import OnnxPoseEstimator
from ._session import NETWORK_TIME, OnnxModel, OnnxSettings

__all__ = [
    "NETWORK_TIME",
    "MediaPipePoseEstimator",
    "OnnxModel",
    "OnnxPersonDetector",
    "OnnxPoseEstimator",
    "OnnxSettings",
]
