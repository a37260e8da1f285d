"""Networks: ONNX models, detectors, estimators of poses and eyes; head poses are in ``heads``."""

from __future__ import annotations

from ._images import PixelFormat, rgb_image
from ._model import NETWORK_TIME, OnnxModel
from ._settings import PROVIDERS, OnnxSettings, Provider, parse_provider_options
from .detectors import OnnxPersonDetector
from .poses import MediaPipeEyeEstimator, MediaPipePoseEstimator, OnnxPoseEstimator

__all__ = [
    "NETWORK_TIME",
    "PROVIDERS",
    "MediaPipeEyeEstimator",
    "MediaPipePoseEstimator",
    "OnnxModel",
    "OnnxPersonDetector",
    "OnnxPoseEstimator",
    "OnnxSettings",
    "PixelFormat",
    "Provider",
    "parse_provider_options",
    "rgb_image",
]
