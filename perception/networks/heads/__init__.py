"""Head pose networks: direction and distance of a head from a crop around it.

:class:`OnnxHeadPoseEstimator` is the estimator. The other names cut the same crops for training:
``head_crop`` cuts a square out of an image, and the ``ray_…`` functions and ``looking_at`` turn the
camera towards a head, so that a crop looks the same anywhere in a wide image.
"""

from __future__ import annotations

from ._crops import (
    OUTSIDE_GREY,
    crop_to_image,
    head_crop,
    looking_at,
    ray_axes,
    ray_focal_px,
    ray_stretch,
)
from ._estimator import OnnxHeadPoseEstimator

__all__ = [
    "OUTSIDE_GREY",
    "OnnxHeadPoseEstimator",
    "crop_to_image",
    "head_crop",
    "looking_at",
    "ray_axes",
    "ray_focal_px",
    "ray_stretch",
]
