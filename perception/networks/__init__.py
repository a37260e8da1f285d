"""Networks: ONNX and TFLite models, detectors, pose estimators; see ``heads`` and ``faces``."""

from __future__ import annotations

from ._images import PixelFormat, rgb_image
from ._model import NETWORK_TIME, OnnxModel
from ._settings import PROVIDERS, OnnxSettings, Provider, parse_provider_options
from ._tflite import TfliteModel, is_tflite
from .detectors import EfficientDetPersonDetector, OnnxPersonDetector
from .poses import BlazePoseEstimator, OnnxPoseEstimator

__all__ = [
    "NETWORK_TIME",
    "PROVIDERS",
    "BlazePoseEstimator",
    "EfficientDetPersonDetector",
    "OnnxModel",
    "OnnxPersonDetector",
    "OnnxPoseEstimator",
    "OnnxSettings",
    "PixelFormat",
    "Provider",
    "TfliteModel",
    "is_tflite",
    "parse_provider_options",
    "rgb_image",
]
