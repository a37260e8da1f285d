"""Networks: ONNX models, person detectors and pose estimators; head poses are in ``heads``."""

from __future__ import annotations

from ._image import rgb_image
from ._model import NETWORK_TIME, OnnxModel, OnnxSettings
from ._pixels import PixelFormat
from .detectors import OnnxPersonDetector
from .poses import MediaPipePoseEstimator, OnnxPoseEstimator

__all__ = [
    "NETWORK_TIME",
    "MediaPipePoseEstimator",
    "OnnxModel",
    "OnnxPersonDetector",
    "OnnxPoseEstimator",
    "OnnxSettings",
    "PixelFormat",
    "rgb_image",
]
