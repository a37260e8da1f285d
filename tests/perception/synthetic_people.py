"""Synthetic people with known keypoints, position and head pose in the camera frame.

The body is the average adult of the parametric model anny 0.6.2 (stature 1.83 m, arms slightly away
from the body), scaled to a given stature. Its proportions differ from the library's constants,
which are averages of more than one source.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from perception import (
    AttentionCone,
    Camera,
    HeadPose,
    PersonDetection,
    PersonKeypoints,
    PnpHeadPoseEstimator,
)
from perception.anthropometry import EYES_HEAD_M, HEAD_TEMPLATE_M
from perception.awareness import estimate_awareness

BODY_STATURE_M = 1.83
#: Rotation of a head that faces the camera, in the camera frame.
FACING = np.stack([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]], axis=1)
# Forward, left, up from the mid-hip.
_SHOULDER, _ELBOW, _WRIST = (0.007, 0.175, 0.537), (0.025, 0.363, 0.313), (0.193, 0.501, 0.168)
_HIP, _KNEE, _ANKLE = (0.013, 0.099, 0.0), (0.022, 0.156, -0.424), (-0.003, 0.197, -0.849)
_NOSE = (0.151, 0.0, 0.734)
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


class KnownShape(PnpHeadPoseEstimator):
    """An estimator that takes all heads for ones of exactly the template's shape."""

    def __init__(self) -> None:
        super().__init__()
        self._shape_factor_m = None


class Given:
    """A detector, pose estimator and head pose estimator with fixed answers.

    Without detections, boxes hold the keypoints tightly.
    """

    def __init__(
        self,
        people: Sequence[PersonKeypoints],
        detections: Sequence[PersonDetection] | None = None,
        heads: Sequence[HeadPose | None] = (),
    ) -> None:
        self.people, self.heads = tuple(people), tuple(heads)
        if detections is None:
            pixels = [person.keypoints_px for person in people]
            boxes = [np.r_[each.min(axis=0), each.max(axis=0)] for each in pixels]
            detections = [PersonDetection(box, 0.9) for box in boxes]
        self.detections = tuple(detections)

    def detect(self, image_rgb: Any) -> tuple[PersonDetection, ...]:
        return self.detections

    def estimate(self, image_rgb: Any, *given: Any) -> tuple[Any, ...]:
        # Head pose estimators get the camera as well.
        return self.people if len(given) == 1 else self.heads


def awareness_of(
    head: HeadPose,
    *,
    seen: float = 1.0,
    eye_std_rad: tuple[float, float] = (0.0, 0.0),
    extra_std_rad: float = 0.0,
    points_m: Any = ((0.0, 0.0, 0.0),),
    eyes: Sequence[Any] = (),
) -> tuple[float, float]:
    """Return α and its standard deviation; by default eyes look where the head points."""
    (found,) = estimate_awareness(
        AttentionCone(),
        (head,),
        np.asarray(points_m),
        extra_std_rad=np.array([extra_std_rad]),
        eye_in_head_std_rad=eye_std_rad,
        face_seen=np.array([seen]),
        eyes=eyes,
    )
    return found.awareness, found.awareness_std
