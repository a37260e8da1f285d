"""Where a body is: metric keypoints in the camera frame, and the point a planner cares about."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from . import layouts as kp
from ._camera import Camera
from ._keypoints import PersonKeypoints
from ._metric_scale import DEFAULT_MIN_SCORE, metric_scales
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
_SHOULDERS: Final = slice(kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER + 1)
_HIPS: Final = slice(kp.LEFT_HIP, kp.RIGHT_HIP + 1)
_UP_CAMERA: Final = np.array([0.0, -1.0, 0.0])
_ITERATIONS: Final = 4
# Far below what scale leaves uncertain.
_CONVERGED: Final = 1e-3
_IDENTITY: Final = np.eye(3)


@dataclass(frozen=True, slots=True, eq=False)
class BodyPlacement:
    """A person's metric keypoints in the camera frame.

    Attributes:
        shoulders_camera_m: (2, 3) left and right, or None when the skeleton does not tell.
        hips_camera_m: (3,) their midpoint.
        position_camera_m: (3,) the body's centre line at chest height.
        position_covariance_m2: (3, 3).
        scale_relative_std: the part of the range that scale leaves uncertain.
        keypoints_camera_m: (17, 3) the whole skeleton, guessed parts included.
    """

    shoulders_camera_m: FloatArray | None
    hips_camera_m: FloatArray
    position_camera_m: FloatArray
    position_covariance_m2: FloatArray
    scale_relative_std: float
    keypoints_camera_m: FloatArray


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
    return place_bodies(camera, (person,), keypoint_std_px, min_score)[0]


def place_bodies(
    camera: Camera,
    people: Sequence[PersonKeypoints],
    keypoint_std_px: float,
    min_score: float = DEFAULT_MIN_SCORE,
) -> tuple[BodyPlacement | None, ...]:
    """Return :func:`place_body` of several people at once."""
    scales = metric_scales(people, min_score)
    width = min((min(len(person.scores), _BODY_AND_FEET) for person in people), default=0)
    if not width:
        return ()
    scores = np.array([person.scores[:width] for person in people])
    seen = (scores >= min_score) & np.array([scale is not None for scale in scales])[:, None]
    factor = np.array([1.0 if scale is None else scale.factor for scale in scales])
    points = factor[:, None, None] * np.array(
        [person.keypoints_root_m[:width] for person in people]
    )
    pixels = np.array([person.keypoints_px[:width] for person in people])
    rays = camera.normalise(pixels.reshape(-1, 2)).reshape(pixels.shape)
    translation, covariance, valid = _translations(
        points, rays, seen, camera.fx_px, keypoint_std_px
    )
    shoulders, usable, hips, chest = _trunks(points, seen)
    valid &= chest[:, 2] + translation[:, 2] > 0.0
    chest += translation
    covariance += _LIFT_STD_M**2 * _IDENTITY
    return tuple(
        None
        if scale is None or not valid[row]
        else BodyPlacement(
            shoulders[row] + translation[row] if usable[row] else None,
            hips[row] + translation[row],
            chest[row],
            covariance[row] + scale.relative_std**2 * (chest[row][:, None] * chest[row]),
            scale.relative_std,
            points[row, :17] + translation[row],
        )
        for row, scale in enumerate(scales)
    )


def _translations(
    points: FloatArray,
    rays: FloatArray,
    seen: NDArray[np.bool_],
    focal_px: float,
    keypoint_std_px: float,
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Weighted solutions of (X + tx) − x (Z + tz) = 0 and (Y + ty) − y (Z + tz) = 0.

    Args:
        points: (P, N, 3) skeletons in metres.
        rays: (P, N, 2) x/z and y/z where their points were seen.
        seen: (P, N); the others do not count.
        focal_px: turns rays into pixels.
        keypoint_std_px: of the pixels, at least.

    Returns:
        Translations (P, 3), their covariances (P, 3, 3) and whether each is one (P,).
    """
    count = seen.sum(axis=1)
    mask = seen.astype(np.float64)
    # With p = t_xy − ray · tz + start, tz is the slope of start over ray.
    start = points[..., :2] - rays * points[..., 2:]
    weight = mask
    everything = np.maximum(keypoint_std_px, 1e-9)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        depth_of_root = np.zeros(len(count))
        for iteration in range(_ITERATIONS):
            previous = depth_of_root
            share = (weight / weight.sum(axis=1, keepdims=True))[..., None]
            middle, level = np.sum(share * rays, axis=1), np.sum(share * start, axis=1)
            away, rise = rays - middle[:, None], start - level[:, None]
            depth_of_root = np.sum(share * away * rise, axis=(1, 2)) / np.sum(
                share * away**2, axis=(1, 2)
            )
            depth = points[..., 2] + depth_of_root[:, None]
            error_px = (focal_px / depth)[..., None] * (rise - away * depth_of_root[:, None, None])
            error_px = np.sqrt(error_px[..., 0] ** 2 + error_px[..., 1] ** 2)
            moved = np.abs(depth_of_root - previous) > _CONVERGED * np.abs(depth_of_root)
            if iteration + 1 < _ITERATIONS and (iteration == 0 or moved.any()):
                robust = 3.0 * np.maximum(everything, _masked_median(error_px, seen, count))
                huber = np.minimum(1.0, robust[:, None] / np.maximum(error_px, 1e-9))
                weight = np.where(seen, huber / depth**2, 0.0)
                continue
            break
        translation = np.column_stack([middle * depth_of_root[:, None] - level, depth_of_root])
        # Huber's weights without the 1/depth² that turns metres into pixels.
        relative = np.where(seen, weight * depth**2, 0.0)
        spread = np.sum(relative * np.where(seen, error_px, 0.0) ** 2, axis=1)
        variance = np.maximum(keypoint_std_px**2, spread / np.maximum(2 * count - 3, 1))
        strength = np.where(seen, relative * (focal_px / depth) ** 2, 0.0)[..., None]
        total = strength.sum(axis=(1, 2))
        first = np.sum(strength * rays, axis=1)
        second = np.sum(strength * rays**2, axis=(1, 2)) - np.sum(first**2, axis=1) / total
        ahead = np.where(seen, depth, 1.0).min(axis=1) > 0.0
    valid = (count >= _MIN_POINTS) & ahead & np.isfinite(translation).all(axis=1)
    valid &= np.isfinite(second) & (second > 1e-12 * total)
    # Inverse of [[S, 0, −a], [0, S, −b], [−a, −b, q]] with the Schur complement q − (a² + b²)/S.
    slope = np.column_stack(
        [first / np.where(total > 0.0, total, 1.0)[:, None], np.ones(len(count))]
    )
    covariance = slope[:, :, None] * slope[:, None] / np.where(valid, second, 1.0)[:, None, None]
    covariance[:, [0, 1], [0, 1]] += (1.0 / np.where(valid, total, 1.0))[:, None]
    return translation, variance[:, None, None] * covariance, valid


def _masked_median(
    values: FloatArray, seen: NDArray[np.bool_], count: NDArray[np.intp]
) -> FloatArray:
    """(P,) medians of the seen values of each row; of none, whatever."""
    ordered = np.sort(np.where(seen, values, np.inf), axis=1)
    rows, last = np.arange(len(ordered)), np.maximum(count - 1, 0)
    return np.asarray(0.5 * (ordered[rows, last // 2] + ordered[rows, (last + 1) // 2]))


def _trunks(
    skeletons: FloatArray, seen: NDArray[np.bool_]
) -> tuple[FloatArray, NDArray[np.bool_], FloatArray, FloatArray]:
    """Shoulders (P, 2, 3), whether usable (P,), hips and chest (P, 3), relative to the root.

    The midpoint of the hips is the root by definition where they are not seen. In a profile one
    shoulder hides the other, yet a lifting network says where it is; that is believed when it lies
    where a shoulder can be. Without shoulders the chest stands above the hips.
    """
    both = skeletons[:, _HIPS]
    shown = np.asarray(seen[:, _HIPS].all(axis=1))[:, None]
    hips = np.where(shown, 0.5 * (both[:, 0] + both[:, 1]), 0.0)
    shoulders = skeletons[:, _SHOULDERS]
    reach = np.sqrt(np.einsum("psi,psi->ps", shoulders, shoulders))
    low, high = _SHOULDER_REACH_M
    there = seen[:, _SHOULDERS] | ((reach > low) & (reach < high))
    usable = there[:, 0] & there[:, 1]
    neck = np.where(
        usable[:, None],
        0.5 * (shoulders[:, 0] + shoulders[:, 1]),
        hips + _TORSO_M * _UP_CAMERA,
    )
    return shoulders, usable, hips, (1.0 - CHEST_FRACTION) * neck + CHEST_FRACTION * hips


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
