"""The shipped networks: loading them, their manifest, and what networks have seen in training."""

from __future__ import annotations

import math
from typing import Final

from ._camera import Camera
from ._manifest import (
    DETECTOR,
    HEAD,
    LEGS,
    POSE,
    TRAINING_DOMAINS,
    ShippedModel,
    TrainingDomain,
    shipped_model,
    shipped_model_path,
    shipped_models,
    simulator_networks,
    simulator_networks_warning,
    verify_shipped_model,
)
from ._stages import DEFAULT_SCORE_THRESHOLD
from .networks import OnnxModel, OnnxPersonDetector, OnnxPoseEstimator, OnnxSettings
from .networks.heads import OnnxHeadPoseEstimator

__all__ = [
    "DETECTOR",
    "HEAD",
    "LEGS",
    "POSE",
    "TRAINING_DOMAINS",
    "ShippedModel",
    "TrainingDomain",
    "detector_input_size",
    "shipped_detector",
    "shipped_head_pose_estimator",
    "shipped_model",
    "shipped_model_path",
    "shipped_models",
    "shipped_pose_estimator",
    "simulator_networks",
    "simulator_networks_warning",
    "verify_shipped_model",
]

# Size of the detector's training images, and the focal length of its input in use: that of a 60°
# camera 448 pixels wide. At 320 one person in ten at 5–10 m is not found.
_DETECTOR_WIDTH_PX, _DETECTOR_HEIGHT_PX, _DETECTOR_STRIDE = 320, 256, 32
_DETECTOR_FOCAL_PX: Final = 224.0 / math.tan(math.radians(30.0))
_DETECTOR_MAX_ENLARGEMENT: Final = 2.0


def shipped_detector(
    settings: OnnxSettings | None = None,
    camera: Camera | None = None,
    *,
    score_threshold: float = DEFAULT_SCORE_THRESHOLD,
) -> OnnxPersonDetector:
    """Return the shipped person detector; errors as in :meth:`OnnxModel.shipped`.

    Args:
        settings: providers and threads.
        camera: camera of its images; a wide field of view gets a larger input.
        score_threshold: detections with a lower score are dropped.
    """
    return OnnxPersonDetector(
        OnnxModel.shipped(DETECTOR, settings),
        score_threshold=score_threshold,
        input_size_hw_px=None if camera is None else detector_input_size(camera),
    )


def detector_input_size(camera: Camera) -> tuple[int, int]:
    """Return height and width of the detector's input for a camera.

    The input has at least as many pixels per radian as a 60° camera at 448 × 352. Its sides grow
    by a factor of at most 2 over 320 × 256, the detector's training size; with still wider fields
    of view people appear smaller.
    """
    width, height = camera.width_px, camera.height_px
    fitting = min(_DETECTOR_WIDTH_PX / width, _DETECTOR_HEIGHT_PX / height)
    wanted = _DETECTOR_FOCAL_PX / (camera.fx_px * fitting)
    scale = fitting * min(max(wanted, 1.0), _DETECTOR_MAX_ENLARGEMENT)

    def padded(length_px: float) -> int:
        return math.ceil(round(length_px, 6) / _DETECTOR_STRIDE) * _DETECTOR_STRIDE

    return padded(height * scale), padded(width * scale)


def shipped_pose_estimator(settings: OnnxSettings | None = None) -> OnnxPoseEstimator:
    """Return the shipped body pose network; errors as in :meth:`OnnxModel.shipped`."""
    return OnnxPoseEstimator(OnnxModel.shipped(POSE, settings))


def shipped_head_pose_estimator(settings: OnnxSettings | None = None) -> OnnxHeadPoseEstimator:
    """Return the shipped head pose network; errors as in :meth:`OnnxModel.shipped`."""
    return OnnxHeadPoseEstimator(OnnxModel.shipped(HEAD, settings))
