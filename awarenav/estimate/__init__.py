"""Estimates of people in images, videos, cameras and recordings: ``awarenav estimate``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._camera import fixed_camera_pose
    from ._estimator import Networks, RecordingPoseEstimator, track_of_each
    from ._networks import SHIPPED, choose_networks

__all__ = [
    "SHIPPED",
    "Networks",
    "RecordingPoseEstimator",
    "choose_networks",
    "fixed_camera_pose",
    "track_of_each",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._camera": ("fixed_camera_pose",),
        "._estimator": (
            "RecordingPoseEstimator",
            "Networks",
            "track_of_each",
        ),
        "._networks": (
            "SHIPPED",
            "choose_networks",
        ),
    },
)
