"""Interfaces of the pipeline's stages; any object with these methods can be used."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from ._camera import Camera
from ._detection import PersonDetection
from ._head_pose import HeadPose
from ._keypoints import PersonKeypoints
from .arrays import ImageRgb


@runtime_checkable
class PersonDetector(Protocol):
    """Interface: finds people in an image."""

    def detect(self, image_rgb: ImageRgb) -> tuple[PersonDetection, ...]:
        """Return the people in an (H, W, 3) RGB image; an empty tuple if there are none."""
        ...


@runtime_checkable
class PoseEstimator(Protocol):
    """Interface: finds the keypoints of detected people."""

    def estimate(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return one set of keypoints per detection, in the same order."""
        ...


@runtime_checkable
class HeadPoseEstimator(Protocol):
    """Interface: finds the head poses of people whose keypoints are known."""

    def estimate(
        self, image_rgb: ImageRgb, camera: Camera, people: tuple[PersonKeypoints, ...]
    ) -> tuple[HeadPose | None, ...]:
        """Return one head pose per person, in the same order; None where there is no evidence."""
        ...
