"""Head poses from a network on crops about the heads."""

from __future__ import annotations

from ._crops import OUTSIDE_GREY, crop_to_image, head_crop
from ._estimator import OnnxHeadPoseEstimator
from ._ray_view import ray_axes, ray_stretch

__all__ = [
    "OUTSIDE_GREY",
    "OnnxHeadPoseEstimator",
    "crop_to_image",
    "head_crop",
    "ray_axes",
    "ray_stretch",
]
