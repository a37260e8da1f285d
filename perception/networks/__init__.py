"""Everything that runs a network: sessions, person detectors, body poses and head poses."""

from __future__ import annotations

from ._mediapipe import MediaPipePoseEstimator
from ._session import OnnxModel, OnnxSettings

__all__ = ["MediaPipePoseEstimator", "OnnxModel", "OnnxSettings"]
