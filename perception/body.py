"""Bodies in the camera frame: metric scale of skeletons, their keypoints, and the chest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import compress
from operator import mul
from typing import Final

import numpy as np
from numpy.typing import NDArray

from . import layouts as kp
from ._camera import Camera
from ._stages import PersonKeypoints
from .anthropometry import LIMBS, MEAN_STATURE_M, STATURE_RELATIVE_STD
from .arrays import FloatArray, median_of

#: Keypoints scored below this count as not seen.
DEFAULT_MIN_SCORE: Final = 0.3

# If the scale is within this limit (logarithm) of 1, the skeleton's unit is taken to be the metre;
# otherwise only its proportions are used.
_METRIC_UNIT_LIMIT: Final = 0.15
# Relative standard deviation of the person's size in a skeleton in metres.
_METRIC_UNIT_STD: Final = 0.03
# Relative standard deviations to add if no limb is seen, and for the foreshortening in a flat
# skeleton: 3–5 % for people who stand, 6–16 % for those who sit or bend, the more the less of them
# is seen.
_UNSEEN_RELATIVE_STD: Final = 0.10
_FLAT_RELATIVE_STD: Final = 0.125

_LOG_LENGTHS: Final[FloatArray] = np.log([limb.length_m for limb in LIMBS])
_INFORMATION: Final = tuple(limb.relative_std**-2 for limb in LIMBS)
# Inverse of the Huber limit: a vote counts less beyond 1.5 standard deviations.
_INVERSE_HUBER: Final = tuple(1.0 / (1.5 * limb.relative_std) for limb in LIMBS)


def _midpoint_matrix(ends: Sequence[tuple[int, ...]]) -> FloatArray:
    matrix = np.zeros((len(ends), 17))
    for row, columns in enumerate(ends):
        matrix[row, list(columns)] = 1.0 / len(columns)
    return matrix


# A row takes the keypoint, or the mean of the two keypoints, at one end of a limb.
_START_MATRIX: Final = _midpoint_matrix([limb.start for limb in LIMBS])
_END_MATRIX: Final = _midpoint_matrix([limb.end for limb in LIMBS])
#: (limbs, 17) end minus start of each limb of :data:`~perception.anthropometry.LIMBS`.
LIMB_DIFFERENCE: Final = _END_MATRIX - _START_MATRIX
#: (17, limbs) 1 where a limb uses a keypoint, else 0.
LIMB_KEYPOINTS: Final = ((_START_MATRIX + _END_MATRIX) > 0.0).T.astype(np.float64)


@dataclass(frozen=True, slots=True)
class MetricScale:
    """Factor from a skeleton's unit to metres.

    Attributes:
        factor: the factor, > 0.
        relative_std: its relative standard deviation, mostly the spread of adult stature.
    """

    factor: float
    relative_std: float


# Head poses and positions of a frame need the scales of the same people, so they are cached, for as
# many cameras as work side by side.
@lru_cache(maxsize=8)
def metric_scales(
    people: tuple[PersonKeypoints, ...], min_score: float = DEFAULT_MIN_SCORE
) -> tuple[MetricScale | None, ...]:
    """Estimate the scale of each person's ``keypoints_root_m`` from the limb lengths.

    Each limb with both ends seen votes with the logarithm of (average length / lifted length). Its
    weight depends on how much the limb varies between adults of one stature, and Huber's weights
    limit the effect of a badly lifted limb. If the result is close to 1, the unit of the skeleton
    counts as metre and draws the scale towards 1. Without seen limbs all limbs vote, and the
    standard deviation is larger.

    In a flat skeleton (``lifted`` False) a limb that points at the camera looks short, and none
    looks long. There the limb with the second smallest vote gives the scale, and the unit does not
    count.

    Returns:
        A scale per person; None for a skeleton without any limb.
    """
    if not people:
        return ()
    hidden = np.array([person.scores[kp.BODY] for person in people]) < min_score
    ends = LIMB_DIFFERENCE @ np.array([person.keypoints_root_m[kp.BODY] for person in people])
    lengths = np.sqrt((ends * ends).sum(axis=2))
    present = lengths > 1e-9
    usable = present & (hidden @ LIMB_KEYPOINTS == 0.0)
    votes = _LOG_LENGTHS - np.log(np.maximum(lengths, 1e-9))
    return tuple(
        _scale(*row)
        for row in zip(people, votes.tolist(), usable.tolist(), present.tolist(), strict=True)
    )


def _scale(
    person: PersonKeypoints, votes: list[float], usable: list[bool], present: list[bool]
) -> MetricScale | None:
    """Return the scale of one person from the votes of the limbs on its logarithm."""
    measured = any(usable)
    counted = usable if measured else present
    votes = list(compress(votes, counted))
    if not votes:
        return None
    information = list(compress(_INFORMATION, counted))
    inverse_huber = list(compress(_INVERSE_HUBER, counted))
    middle, total = median_of(votes), 0.0
    for _ in range(4):
        weights = [
            part / max(1.0, abs(vote - middle) * scale)
            for vote, part, scale in zip(votes, information, inverse_huber, strict=True)
        ]
        total = sum(weights)
        middle = sum(map(mul, weights, votes)) / total
    variance = 1.0 / total + STATURE_RELATIVE_STD**2 + person.scale_relative_std**2
    spread = math.sqrt(variance + (0.0 if measured else _UNSEEN_RELATIVE_STD**2))
    if not person.lifted:
        middle = sorted(votes)[1 if len(votes) >= 3 else 0]
        spread = math.hypot(spread, _FLAT_RELATIVE_STD)
    elif abs(middle) <= _METRIC_UNIT_LIMIT:
        middle *= _METRIC_UNIT_STD**2 / (_METRIC_UNIT_STD**2 + spread**2)
    return MetricScale(math.exp(middle), spread)


_TORSO_M: Final = LIMBS[0].length_m
#: Distance of the chest below the shoulders, as a fraction of the torso.
CHEST_FRACTION: Final = 0.3
# A box gives only a rough range: arms reach out, and shelves hide legs. Children and people who
# bend or sit come on top of it (``_placement``).
_BOX_RELATIVE_STD: Final = 0.25
# Of a box that the border cuts, the width counts: a standing adult is 3.3 times as high as wide,
# from in front and from the side, arms down or not, within a third.
_HEIGHT_PER_WIDTH, _HEIGHT_PER_WIDTH_LOG_STD = 3.3, 0.35
# Otherwise it only limits what else hides of the height.
_LEAST_HEIGHT_PER_WIDTH: Final = 2.5
# A box counts as cut by the upper or lower border if it ends within this share of the image's
# height.
_BORDER: Final = 0.03
_MIN_POINTS: Final = 3
# Rows of a whole-body layout that count: not the many points of face and hands.
_BODY_AND_FEET: Final = 23
# Smallest and largest distance of a shoulder from the mid-hip, for people who stand, stoop or sit.
_SHOULDER_REACH_M: Final = (0.25, 0.80)
# Standard deviation of the chest relative to the body from lifting: 45 mm per keypoint, averaged
# over four keypoints.
_LIFT_STD_M: Final = 0.025
_UP_CAMERA: Final = np.array([0.0, -1.0, 0.0])
_ITERATIONS: Final = 4
# Relative change of the depth, far below the error of the scale.
_CONVERGED: Final = 1e-3
_IDENTITY: Final = np.eye(3)
_ACROSS: Final = np.diag([1.0, 1.0, 0.0])
# The chest of a standing person in units of the box, from its top left corner: a little below the
# shoulders, which lie at 0.82 of the stature (Drillis and Contini).
_CHEST_IN_BOX: Final = np.array([0.5, 0.27])
_BOX_LATERAL_M2: Final = (0.15 * MEAN_STATURE_M) ** 2 * _IDENTITY
#: Lower bound on the trace of the covariance of a placement by a box.
BOX_LEAST_TRACE_M2: Final = 3.0 * (0.15 * MEAN_STATURE_M) ** 2


@dataclass(frozen=True, slots=True, eq=False)
class BodyPlacement:
    """A person's metric keypoints in the camera frame.

    Attributes:
        shoulders_camera_m: (2, 3) left and right shoulder, or None if they are not known.
        hips_camera_m: (3,) midpoint of the hips.
        position_camera_m: (3,) centre line of the body at chest height.
        position_covariance_m2: (3, 3) covariance of that position.
        scale_relative_std: relative standard deviation of the range from the body's scale.
        keypoints_camera_m: (17, 3) all keypoints of the skeleton, seen or not.
    """

    shoulders_camera_m: FloatArray | None
    hips_camera_m: FloatArray
    position_camera_m: FloatArray
    position_covariance_m2: FloatArray
    scale_relative_std: float
    keypoints_camera_m: FloatArray


@lru_cache(maxsize=8)  # as metric_scales is
def place_bodies(
    camera: Camera,
    people: tuple[PersonKeypoints, ...],
    keypoint_std_px: float,
    min_score: float = DEFAULT_MIN_SCORE,
) -> tuple[BodyPlacement | None, ...]:
    """Place bodies: find the translations that project metric skeletons onto the pixels.

    Linear least squares in the three unknowns of each translation, iterated with Huber's weights on
    the reprojection error. The covariance includes the pixel noise (at least as large as the
    residuals) and the uncertainty of the scale, which acts along the ray.

    Args:
        camera: camera of the image.
        people: keypoints of each person.
        keypoint_std_px: standard deviation of the pixel noise.
        min_score: keypoints with a lower score count as not seen.

    Returns:
        A placement per person; None if fewer than three keypoints are seen, the skeleton has no
        limb, or the body would lie behind the camera.
    """
    scales = metric_scales(people, min_score)
    width = min((min(len(person.scores), _BODY_AND_FEET) for person in people), default=0)
    if not width:
        return ()
    scores = np.array([person.scores[:width] for person in people])
    points = np.array([person.keypoints_root_m[:width] for person in people])
    pixels = np.array([person.keypoints_px[:width] for person in people])
    # A person without a scale is not placed.
    factor, relative_std = np.array(
        [(np.nan, 0.0) if scale is None else (scale.factor, scale.relative_std) for scale in scales]
    ).T
    seen = (scores >= min_score) & (factor > 0.0)[:, None]
    points *= np.where(factor > 0.0, factor, 1.0)[:, None, None]
    rays = camera.normalise(pixels.reshape(-1, 2), nearest=True).reshape(pixels.shape)
    translation, covariance, valid = _translations(
        points, rays, seen, camera.fx_px, keypoint_std_px
    )
    shoulders, usable, hips, chest = _trunks(points, seen)
    chest += translation
    valid &= chest[:, 2] > 0.0
    far = relative_std[:, None] * chest
    covariance += far[:, :, None] * far[:, None] + _LIFT_STD_M**2 * _IDENTITY
    shoulders, hips = shoulders + translation[:, None], hips + translation
    points = points[:, kp.BODY] + translation[:, None]
    return tuple(
        None
        if scale is None or not valid[row]
        else BodyPlacement(
            shoulders[row] if usable[row] else None,
            hips[row],
            chest[row],
            covariance[row],
            scale.relative_std,
            points[row],
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
    """Solve (X + tx) − x (Z + tz) = 0 and (Y + ty) − y (Z + tz) = 0 by weighted least squares.

    Args:
        points: (P, N, 3) skeletons in metres.
        rays: (P, N, 2) measured x/z and y/z of their points.
        seen: (P, N) True for points that count.
        focal_px: focal length, to convert rays to pixels.
        keypoint_std_px: smallest standard deviation of the pixel noise.

    Returns:
        Translations (P, 3), their covariances (P, 3, 3), and (P,) True for valid solutions.
    """
    count = seen.sum(axis=1)
    # With start = (X, Y) − ray · Z, the equations are start + t_xy − ray · tz = 0: tz is the slope
    # of start over ray.
    start = points[..., :2] - rays * points[..., 2:]
    # The weighted sums of these columns give the slope.
    table = np.empty((*seen.shape, 6))
    table[..., :2], table[..., 2:4] = rays, start
    table[..., 4], table[..., 5] = (rays * rays).sum(axis=2), (rays * start).sum(axis=2)
    weight = seen.astype(np.float64)
    huber_limit_px = 3.0 * max(keypoint_std_px, 1e-9)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        depth_of_root = np.zeros(len(count))
        for iteration in range(_ITERATIONS):
            previous = depth_of_root
            mean = (weight[:, None] @ table)[:, 0] / weight.sum(axis=1, keepdims=True)
            middle, level = mean[:, :2], mean[:, 2:4]
            depth_of_root = (mean[:, 5] - (middle * level).sum(axis=1)) / (
                mean[:, 4] - (middle * middle).sum(axis=1)
            )
            across = middle * depth_of_root[:, None] - level
            depth = points[..., 2] + depth_of_root[:, None]
            off = start - rays * depth_of_root[:, None, None] + across[:, None]
            error_px = np.sqrt((off * off).sum(axis=2)) * np.abs(focal_px / depth)
            if iteration and not _has_changed(depth_of_root, previous):
                break
            if iteration + 1 < _ITERATIONS:
                robust = np.maximum(huber_limit_px, 3.0 * _masked_median(error_px, seen))
                huber = np.minimum(1.0, robust[:, None] / np.maximum(error_px, 1e-9))
                weight = np.where(seen, huber / (depth * depth), 0.0)
        translation = np.concatenate([across, depth_of_root[:, None]], axis=1)
        # Huber's weights without the factor 1/depth², which converts metres to pixels.
        relative = np.where(seen, weight * depth * depth, 0.0)
        spread = (relative * np.where(seen, error_px * error_px, 0.0)).sum(axis=1)
        variance = np.maximum(keypoint_std_px**2, spread / np.maximum(2 * count - 3, 1))
        strength = np.where(seen, relative * (focal_px / depth) ** 2, 0.0)
        total = strength.sum(axis=1)
        sums = (strength[:, None] @ table[..., :5])[:, 0]
        first = sums[:, :2]
        second = sums[:, 4] - (first * first).sum(axis=1) / total
        ahead = np.where(seen, depth, 1.0).min(axis=1) > 0.0
    valid = (count >= _MIN_POINTS) & ahead & np.isfinite(translation).all(axis=1)
    valid &= np.isfinite(second) & (second > 1e-12 * total)
    # Inverse of [[S, 0, −a], [0, S, −b], [−a, −b, q]] with the Schur complement q − (a² + b²)/S.
    slope = np.ones((len(count), 3))
    slope[:, :2] = first / np.where(total > 0.0, total, 1.0)[:, None]
    covariance = slope[:, :, None] * slope[:, None] / np.where(valid, second, 1.0)[:, None, None]
    covariance += (1.0 / np.where(valid, total, 1.0))[:, None, None] * _ACROSS
    return translation, variance[:, None, None] * covariance, valid


def _has_changed(values: FloatArray, previous: FloatArray) -> bool:
    return any(
        abs(new - old) > _CONVERGED * abs(new)
        for new, old in zip(values.tolist(), previous.tolist(), strict=True)
    )


def _masked_median(values: FloatArray, seen: NDArray[np.bool_]) -> FloatArray:
    """Return (P,) medians of the seen values of each row; 0 for a row without seen values."""
    rows = zip(values.tolist(), seen.tolist(), strict=True)
    return np.array([median_of(compress(*row)) if any(row[1]) else 0.0 for row in rows])


def _trunks(
    skeletons: FloatArray, seen: NDArray[np.bool_]
) -> tuple[FloatArray, NDArray[np.bool_], FloatArray, FloatArray]:
    """Return shoulders (P, 2, 3), their usability (P,), hips (P, 3) and chest (P, 3).

    All are relative to the root. Where the hips are not seen, their midpoint is the root by
    definition. A shoulder that is not seen (in a profile one hides the other) is usable if the
    lifting network places it at a possible distance from the root. Without usable shoulders, the
    chest is placed above the hips.
    """
    both = skeletons[:, kp.HIPS]
    shown = np.asarray(seen[:, kp.HIPS].all(axis=1))[:, None]
    hips = np.where(shown, 0.5 * (both[:, 0] + both[:, 1]), 0.0)
    shoulders = skeletons[:, kp.SHOULDERS]
    reach = np.sqrt((shoulders * shoulders).sum(axis=2))
    low, high = _SHOULDER_REACH_M
    known = seen[:, kp.SHOULDERS] | ((reach > low) & (reach < high))
    usable = known[:, 0] & known[:, 1]
    neck = np.where(
        usable[:, None],
        0.5 * (shoulders[:, 0] + shoulders[:, 1]),
        hips + _TORSO_M * _UP_CAMERA,
    )
    return shoulders, usable, hips, (1.0 - CHEST_FRACTION) * neck + CHEST_FRACTION * hips


def place_boxes(
    camera: Camera, boxes_xyxy_px: Sequence[FloatArray]
) -> list[tuple[FloatArray, FloatArray] | None]:
    """Estimate positions from boxes, as those of standing adults.

    It is for people whose keypoints cannot place the body. Of a box that ends at the upper or lower
    border of the image only a part of the height is seen: it is taken from the width, if that
    gives more. Any other box counts as at least 2.5 times as high as wide.

    Returns:
        Position (3,) and covariance (3, 3) in the camera frame; None for a box without extent.
    """
    pixels = np.reshape(boxes_xyxy_px, (-1, 2))
    edges = camera.normalise(pixels, nearest=True).reshape(-1, 4)
    low, extent = edges[:, :2], edges[:, 2:] - edges[:, :2]
    boxes = extent.min(axis=1) > 0.0
    over, under = cut_by_border(camera, pixels.reshape(-1, 4))
    cut = over | under
    per_width = np.where(cut, _HEIGHT_PER_WIDTH, _LEAST_HEIGHT_PER_WIDTH)
    height = np.maximum(np.maximum(extent[:, 1], per_width * extent[:, 0]), 1e-9)
    position = np.ones((len(edges), 3))
    position[:, :2] = low + np.stack([extent[:, 0], height], axis=1) * _CHEST_IN_BOX
    # Where the head is outside the image, the chest may be anywhere in it.
    middle = low[:, 1] + 0.5 * extent[:, 1]
    position[:, 1] = np.where(over, middle, position[:, 1])
    position *= (MEAN_STATURE_M / height)[:, None]
    relative = np.where(cut, _HEIGHT_PER_WIDTH_LOG_STD, _BOX_RELATIVE_STD)
    variance = relative * relative + STATURE_RELATIVE_STD**2
    covariance = variance[:, None, None] * (position[:, :, None] * position[:, None])
    covariance += _BOX_LATERAL_M2
    placed = zip(position, covariance, strict=True)
    return [pair if box else None for pair, box in zip(placed, boxes.tolist(), strict=True)]


def cut_by_border(
    camera: Camera, boxes_xyxy_px: FloatArray
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return (N,) True for boxes (N, 4) that end at the upper, and at the lower border."""
    margin = _BORDER * camera.height_px
    return boxes_xyxy_px[:, 1] < margin, boxes_xyxy_px[:, 3] > camera.height_px - margin
