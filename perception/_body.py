"""Where a body is: metric keypoints in the camera frame, and the point a planner cares about."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from . import layouts as kp
from ._camera import Camera
from ._keypoints import PersonKeypoints
from ._metric_scale import DEFAULT_MIN_SCORE, metric_scale
from .anthropometry import LIMBS, MEAN_STATURE_M, STATURE_RELATIVE_STD
from .arrays import FloatArray

_TORSO_M: Final = LIMBS[0].length_m
#: The chest lies this fraction of the torso below the shoulders.
CHEST_FRACTION: Final = 0.3
# A box says little about depth: people stoop, sit and are cut off.
_BOX_DEPTH_RELATIVE_STD: Final = 0.25
_MIN_POINTS: Final = 3
# Face and hands of a whole-body layout are many points on two small spots; the body is enough.
_BODY_AND_FEET: Final = 23
# How far shoulders lie from the mid-hip of people who stand, stoop or sit.
_SHOULDER_REACH_M: Final = (0.25, 0.80)
# What lifting leaves uncertain of the chest within the body: 45 mm a keypoint, averaged over four.
_LIFT_STD_M: Final = 0.025
_UP_CAMERA: Final = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class BodyPlacement:
    """A person's metric keypoints in the camera frame.

    Attributes:
        shoulders_camera_m: (2, 3) left and right, or None when the skeleton does not tell.
        hips_camera_m: (3,) their midpoint.
        position_camera_m: (3,) the body's centre line at chest height.
        position_covariance_m2: (3, 3).
        scale_relative_std: the part of the range that scale leaves uncertain.
    """

    shoulders_camera_m: FloatArray | None
    hips_camera_m: FloatArray
    position_camera_m: FloatArray
    position_covariance_m2: FloatArray
    scale_relative_std: float


def place_body(
    camera: Camera,
    person: PersonKeypoints,
    keypoint_std_px: float,
    min_score: float = DEFAULT_MIN_SCORE,
) -> BodyPlacement | None:
    """Find the translation that projects the rescaled skeleton onto its pixels.

    Linear least squares in the three unknowns of the translation, iterated with Huber's weights on
    the reprojection error. The covariance holds pixel noise (no smaller than the residuals say) and
    the uncertainty of scale, which acts along the ray.

    Returns None when fewer than three keypoints were seen, the skeleton has no limb, or the body
    would lie behind the camera.
    """
    scale = metric_scale(person, min_score)
    rows = np.flatnonzero(person.scores[:_BODY_AND_FEET] >= min_score)
    if scale is None or len(rows) < _MIN_POINTS:
        return None
    points = scale.factor * person.keypoints_root_m[rows]
    rays = camera.normalise(person.keypoints_px[rows])
    solved = _translation(points, rays, camera.fx_px, keypoint_std_px)
    if solved is None:
        return None
    translation, covariance = solved
    skeleton = scale.factor * person.keypoints_root_m[:17]
    seen = person.scores[:17] >= min_score
    hips = translation + _hips(skeleton, seen)
    shoulders = _shoulders(skeleton, seen)
    if shoulders is None:
        chest = hips + (1.0 - CHEST_FRACTION) * _TORSO_M * _UP_CAMERA
    else:
        shoulders = shoulders + translation
        chest = (1.0 - CHEST_FRACTION) * shoulders.mean(axis=0) + CHEST_FRACTION * hips
    if chest[2] <= 0.0:
        return None
    covariance += scale.relative_std**2 * np.outer(chest, chest) + _LIFT_STD_M**2 * np.eye(3)
    return BodyPlacement(shoulders, hips, chest, covariance, scale.relative_std)


def _translation(
    points: FloatArray, rays: FloatArray, focal_px: float, keypoint_std_px: float
) -> tuple[FloatArray, FloatArray] | None:
    """Weighted solution of (X + tx) − x (Z + tz) = 0 and (Y + ty) − y (Z + tz) = 0."""
    count = len(points)
    design = np.zeros((count, 2, 3))
    design[:, 0, 0] = design[:, 1, 1] = 1.0
    design[:, :, 2] = -rays
    target = rays * points[:, 2:] - points[:, :2]
    weight = np.ones(count)
    translation = np.zeros(3)
    for iteration in range(4):
        information = np.einsum("n,nij,nik->jk", weight, design, design)
        try:
            translation = np.linalg.solve(
                information, np.einsum("n,nij,ni->j", weight, design, target)
            )
        except np.linalg.LinAlgError:
            return None
        depth = points[:, 2] + translation[2]
        if not np.isfinite(translation).all() or depth.min() <= 0.0:
            return None
        residual_px = (design @ translation - target) * (focal_px / depth)[:, None]
        error_px = np.linalg.norm(residual_px, axis=1)
        if iteration < 3:
            robust = 3.0 * max(keypoint_std_px, float(np.median(error_px)))
            weight = np.minimum(1.0, robust / np.maximum(error_px, 1e-9)) / depth**2
    degrees = max(2 * count - 3, 1)
    # Huber's weights without the 1/depth² that turns metres into pixels.
    relative = weight * depth**2
    variance = max(keypoint_std_px**2, float(np.sum(relative * error_px**2)) / degrees)
    jacobian_px = design * (focal_px / depth)[:, None, None]
    information = np.einsum("n,nij,nik->jk", relative, jacobian_px, jacobian_px)
    if np.linalg.cond(information) > 1e12:
        return None
    return translation, variance * np.linalg.inv(information)


def _hips(skeleton: FloatArray, seen: NDArray[np.bool_]) -> FloatArray:
    """Midpoint of the hips relative to the root, which it is by definition."""
    hips = [kp.LEFT_HIP, kp.RIGHT_HIP]
    return np.asarray(skeleton[hips].mean(axis=0)) if seen[hips].all() else np.zeros(3)


def _shoulders(skeleton: FloatArray, seen: NDArray[np.bool_]) -> FloatArray | None:
    """(2, 3) shoulders relative to the root.

    In a profile one shoulder hides the other, yet a lifting network says where it is; that is
    believed when it lies where a shoulder can be.
    """
    shoulders = skeleton[[kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER]]
    reach = np.linalg.norm(shoulders, axis=1)
    low, high = _SHOULDER_REACH_M
    usable = seen[[kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER]] | ((reach > low) & (reach < high))
    return shoulders if usable.all() else None


def place_box(camera: Camera, box_xyxy_px: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Guess a position from the box of a standing adult when keypoints cannot place the body.

    Returns position (3,) and covariance (3, 3) in the camera frame, or None for a box of no height.
    A box that is cut off by the image border looks farther away than it is; that error is bounded
    by taking the larger of height and 2.5 × width as the height.
    """
    left, top, right, bottom = (float(edge) for edge in box_xyxy_px)
    corners = camera.normalise([[left, top], [right, bottom]])
    width, height = (float(extent) for extent in corners[1] - corners[0])
    if height <= 0.0 or width <= 0.0:
        return None
    range_m = MEAN_STATURE_M / max(height, 2.5 * width)
    # Shoulders stand at 0.82 of the stature and the chest a little below (Drillis and Contini).
    across = 0.5 * float(corners[0, 0] + corners[1, 0])
    down = float(corners[0, 1]) + 0.27 * height
    position = range_m * np.array([across, down, 1.0])
    relative = math.hypot(_BOX_DEPTH_RELATIVE_STD, STATURE_RELATIVE_STD)
    lateral = 0.15 * MEAN_STATURE_M
    covariance = relative**2 * np.outer(position, position) + lateral**2 * np.eye(3)
    return position, covariance
