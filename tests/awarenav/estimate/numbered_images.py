"""Images whose mean grey level is their number, and networks that place a person by that number."""

from __future__ import annotations

import math

import numpy as np

from perception import Camera, PersonDetection, PersonKeypoints, PnpHeadPoseEstimator
from perception.named import Networks

WIDTH, HEIGHT = 320, 240
CAMERA = Camera.from_fov(WIDTH, HEIGHT, math.radians(60.0))
_STEP = 8
# A standing adult of 1.75 m in camera axes, relative to mid-hip, facing the camera: COCO's 17.
_BODY_M = np.array(
    [
        [0.0, -0.68, -0.10], [0.03, -0.71, -0.08], [-0.03, -0.71, -0.08], [0.07, -0.69, 0.02],
        [-0.07, -0.69, 0.02], [0.18, -0.48, 0.0], [-0.18, -0.48, 0.0], [0.22, -0.20, 0.0],
        [-0.22, -0.20, 0.0], [0.22, 0.05, -0.02], [-0.22, 0.05, -0.02], [0.10, 0.0, 0.0],
        [-0.10, 0.0, 0.0], [0.10, 0.42, 0.0], [-0.10, 0.42, 0.0], [0.10, 0.83, 0.02],
        [-0.10, 0.83, 0.02],
    ]
)  # fmt: skip


def numbered(number: int, size_px: tuple[int, int] = (WIDTH, HEIGHT)) -> np.ndarray:
    """(H, W, 3) RGB image of a number from 0 to 29."""
    image = np.full((size_px[1], size_px[0], 3), 8 + _STEP * number, np.uint8)
    # One colour would be no view.
    image[:, : size_px[0] // 2] -= _STEP // 2
    image[:, size_px[0] // 2 :] += _STEP // 2
    return image


def number_of(image_rgb: np.ndarray) -> int:
    return round((float(image_rgb.mean()) - 8.0) / _STEP)


def standing_at(x_m: float, z_m: float, camera: Camera = CAMERA) -> PersonKeypoints:
    """Exact keypoints of somebody who stands there and faces along the camera's axis."""
    points = _BODY_M + np.array([x_m, 0.3, z_m])
    return PersonKeypoints(camera.project(points), _BODY_M, np.full(17, 0.95), "coco")


class NumberReader:
    """Detector and pose estimator: one person, who walks to the right from image to image."""

    def __init__(self, camera: Camera = CAMERA, *, fail_at: tuple[int, ...] = (), error=None):
        self.camera = camera
        self.seen: list[int] = []
        self._fail_at = fail_at
        self._error = error

    def detect(self, image_rgb):
        number = number_of(image_rgb)
        self.seen.append(number)
        if number in self._fail_at:
            raise self._error
        points = self._person(number).keypoints_px
        low, high = points.min(axis=0) - 6.0, points.max(axis=0) + 6.0
        return (PersonDetection(np.concatenate([low, high]), 0.9),)

    def estimate(self, image_rgb, detections):
        return tuple(self._person(number_of(image_rgb)) for _ in detections)

    def _person(self, number: int) -> PersonKeypoints:
        return standing_at(-0.6 + 0.05 * number, 3.5, self.camera)

    @property
    def networks(self) -> Networks:
        return Networks(self, self, PnpHeadPoseEstimator())
