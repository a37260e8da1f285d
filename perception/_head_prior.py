"""Prior of a head's pose: from the torso, or from how people carry their heads."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from .anthropometry import HEAD_CENTRE_HEAD_M
from .arrays import FloatArray
from .body import BodyPlacement
from .matrices import rotation_exp, skew

# The joint of head and neck lies below and between the ears.
_PIVOT_HEAD_M: Final = np.array([0.035, -0.100, 0.0])
# From the shoulder midpoint to that joint, in the torso frame (forward, left, up). With it, the
# nose of a head that looks straight ahead lies where anthropometry says.
_NECK_TO_PIVOT_M: Final = np.array([0.046, 0.0, 0.168])
# Standard deviations of the head's rotation relative to the torso.
_YAW_STD_RAD, _ROLL_STD_RAD, _PITCH_STD_RAD = map(math.radians, (60.0, 15.0, 25.0))
_PIVOT_STD_M: Final = 0.04
#: A head without a body is upright in the camera within this standard deviation.
UPRIGHT_STD_RAD: Final = math.radians(30.0)
# It may look anywhere.
_UNKNOWN_YAW_STD_RAD: Final = math.radians(150.0)
_DOWN_CAMERA: Final = np.array([0.0, 1.0, 0.0])
# Relative standard deviation of the body's range where the head has a range of its own.
_LOOSE_SCALE_STD: Final = 0.25
_YAW_STARTS_RAD: Final = np.radians([0.0, 50.0, -50.0, 100.0, -100.0, 180.0])


@dataclass(frozen=True, slots=True, eq=False)
class HeadPrior:
    """Prior of a head's pose from the body: weak, but enough where few head points are seen.

    Attributes:
        rotation_camera_head: (3, 3) rotation of a head that looks straight ahead of the torso.
        rotation_information: (3, 3) inverse covariance of the head's rotation relative to that, as
            a rotation vector in head axes (x yaw, y roll, z pitch).
        pivot_head_m: (3,) joint of head and neck in the head frame.
        pivot_camera_m: (3,) position of that joint according to the body.
        position_information: (3, 3) inverse covariance of that position, camera frame.
    """

    rotation_camera_head: FloatArray
    rotation_information: FloatArray
    pivot_head_m: FloatArray
    pivot_camera_m: FloatArray
    position_information: FloatArray


def body_prior(body: BodyPlacement | None, *, whole: bool) -> HeadPrior | None:
    """Return the prior of the head's pose from the torso; None if too little of it is seen.

    ``whole`` is True for a head that shows enough keypoints to tell its own range.
    """
    if body is None:
        return None
    torso = _torso_axes(body)
    if torso is None:
        return None
    rotation_camera_torso, neck = torso
    forward, left, up = rotation_camera_torso.T
    pivot = neck + rotation_camera_torso @ _NECK_TO_PIVOT_M
    ray = pivot / np.linalg.norm(pivot)
    relative = max(body.scale_relative_std, _LOOSE_SCALE_STD if whole else 0.0)
    along = (relative * np.linalg.norm(pivot)) ** 2 + _PIVOT_STD_M**2
    covariance = _PIVOT_STD_M**2 * (np.eye(3) - np.outer(ray, ray)) + along * np.outer(ray, ray)
    stds = np.array([_YAW_STD_RAD, _ROLL_STD_RAD, _PITCH_STD_RAD])
    return HeadPrior(
        np.stack([-up, forward, -left], axis=1),
        np.diag(1.0 / stds**2),
        _PIVOT_HEAD_M,
        pivot,
        np.linalg.inv(covariance),
    )


def upright_prior(points: FloatArray, rays: FloatArray) -> HeadPrior:
    """Return the prior of a head without a body: upright, at about the range of its size."""
    span = float(np.linalg.norm(rays - rays.mean(axis=0), axis=1).max())
    size_m = float(np.linalg.norm(points - points.mean(axis=0), axis=1).max())
    # Foreshortening makes a head look smaller: the range is the largest one possible.
    pivot = np.append(rays.mean(axis=0), 1.0) * (0.8 * size_m / max(span, 1e-6))
    ray = pivot / np.linalg.norm(pivot)
    right = skew(_DOWN_CAMERA) @ -ray
    right = right / np.linalg.norm(right)
    down = skew(-ray) @ right
    across, along = _PIVOT_STD_M + 0.1, 0.5 * float(np.linalg.norm(pivot))
    covariance = across**2 * (np.eye(3) - np.outer(ray, ray)) + along**2 * np.outer(ray, ray)
    stds = np.array([_UNKNOWN_YAW_STD_RAD, UPRIGHT_STD_RAD, UPRIGHT_STD_RAD])
    return HeadPrior(
        np.stack([down, -ray, right], axis=1),
        np.diag(1.0 / stds**2),
        HEAD_CENTRE_HEAD_M,
        pivot,
        np.asarray(np.linalg.inv(covariance), dtype=np.float64),
    )


def _torso_axes(body: BodyPlacement) -> tuple[FloatArray, FloatArray] | None:
    """Return forward, left, up as columns (3, 3) and the neck (3,), in the camera frame."""
    shoulders = body.shoulders_camera_m
    if shoulders is None:
        return None
    neck = shoulders.mean(axis=0)
    up, left = neck - body.hips_camera_m, shoulders[0] - shoulders[1]
    forward = skew(left) @ up
    length = float(np.linalg.norm(forward))
    if length < 1e-6:
        return None
    forward = forward / length
    up = up / np.linalg.norm(up)
    return np.stack([forward, skew(up) @ forward, up], axis=1), neck


def prior_starts(prior: HeadPrior) -> tuple[FloatArray, FloatArray]:
    """Return starting poses with several yaw angles about the joint of the prior."""
    down = prior.rotation_camera_head[:, 0]
    rotations = rotation_exp(_YAW_STARTS_RAD[:, None] * down) @ prior.rotation_camera_head
    return rotations, prior.pivot_camera_m - rotations @ prior.pivot_head_m
