"""Perception: from an RGB image to people, their positions and their awareness of the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import _clash  # noqa: F401 - first: reports another distribution with these package names
from .lazy import lazy_page

if TYPE_CHECKING:
    from ._camera import Camera
    from ._floor import FloorPlane
    from ._observation import PersonObservation
    from ._pipeline import AwarenessPipeline
    from ._pnp import PnpHeadPoseEstimator
    from ._stages import (
        HeadPose,
        HeadPoseEstimator,
        PersonDetection,
        PersonDetector,
        PersonKeypoints,
        PoseEstimator,
    )
    from .awareness import AttentionCone
    from .errors import PerceptionError
    from .networks import OnnxPersonDetector, OnnxPoseEstimator
    from .networks.heads import OnnxHeadPoseEstimator

__all__ = [
    "AttentionCone",
    "AwarenessPipeline",
    "Camera",
    "FloorPlane",
    "HeadPose",
    "HeadPoseEstimator",
    "OnnxHeadPoseEstimator",
    "OnnxPersonDetector",
    "OnnxPoseEstimator",
    "PerceptionError",
    "PersonDetection",
    "PersonDetector",
    "PersonKeypoints",
    "PersonObservation",
    "PnpHeadPoseEstimator",
    "PoseEstimator",
]

__getattr__ = lazy_page(__name__, __file__)
