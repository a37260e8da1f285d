"""Synthetic people with known keypoints, position and head pose in the camera frame.

The body is the average adult of the parametric model anny 0.6.2 (stature 1.83 m, arms slightly away
from the body), scaled to a given stature. Its proportions differ from the library's constants,
which are averages of more than one source.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from perception import Camera, PersonKeypoints
from perception.anthropometry import EYES_HEAD_M, HEAD_TEMPLATE_M

BODY_STATURE_M = 1.83
# Forward, left, up from the mid-hip.
_SHOULDER, _ELBOW, _WRIST = (0.007, 0.175, 0.537), (0.025, 0.363, 0.313), (0.193, 0.501, 0.168)
_HIP, _KNEE, _ANKLE = (0.013, 0.099, 0.0), (0.022, 0.156, -0.424), (-0.003, 0.197, -0.849)
_NOSE = (0.151, 0.0, 0.734)
_FLOOR_UP = -0.93
# Upright, facing the camera: forward = −z, left = +x, up = −y of the camera.
_CAMERA_FROM_BODY = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
# From the head frame (x down, y forward, z right) to forward, left, up of the body.
_BODY_FROM_HEAD = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class SyntheticPerson:
    points_camera_m: np.ndarray  # (17, 3)
    chest_camera_m: np.ndarray
    rotation_camera_head: np.ndarray
    eyes_camera_m: np.ndarray

    def keypoints(
        self,
        camera: Camera,
        noise_px: float,
        rng: np.random.Generator,
        *,
        lift_std_m: float = 0.0,
        unit: float = 1.0,
        seen: np.ndarray | None = None,
    ) -> PersonKeypoints:
        root = self.points_camera_m[11:13].mean(axis=0)
        pixels = camera.project(self.points_camera_m) + rng.normal(0.0, noise_px, (17, 2))
        lifted = self.points_camera_m - root
        lifted[:, 2] += rng.normal(0.0, lift_std_m, 17) if lift_std_m else 0.0
        scores = np.ones(17) if seen is None else seen.astype(float)
        return PersonKeypoints(pixels, lifted * unit, scores, "coco")


def person_at(
    position_camera_m: tuple[float, float, float],
    *,
    body_yaw_rad: float = 0.0,
    head_yaw_rad: float = 0.0,
    head_pitch_rad: float = 0.0,
    head_roll_rad: float = 0.0,
    stature_m: float = BODY_STATURE_M,
) -> SyntheticPerson:
    """Return a person with the mid-hip at a position.

    Body yaw 0 faces the camera; head angles are relative to the body.
    """
    scale = stature_m / BODY_STATURE_M
    mirrored = np.array([1.0, -1.0, 1.0])
    pairs = [np.array(p) * m for p in (_SHOULDER, _ELBOW, _WRIST, _HIP, _KNEE, _ANKLE)
             for m in (np.ones(3), mirrored)]  # fmt: skip
    turn = Rotation.from_euler("z", head_yaw_rad) * Rotation.from_euler("y", -head_pitch_rad)
    head = (turn * Rotation.from_euler("x", head_roll_rad)).as_matrix() @ _BODY_FROM_HEAD
    face = np.array(_NOSE) + HEAD_TEMPLATE_M @ head.T
    body = np.vstack([face, *pairs]) * scale
    to_camera = _CAMERA_FROM_BODY @ Rotation.from_euler("z", body_yaw_rad).as_matrix()
    points = body @ to_camera.T + np.array(position_camera_m)
    rotation = to_camera @ head
    chest = 0.7 * points[5:7].mean(axis=0) + 0.3 * points[11:13].mean(axis=0)
    eyes = points[0] + rotation @ EYES_HEAD_M * scale
    return SyntheticPerson(points, chest, rotation, eyes)
