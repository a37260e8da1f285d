"""Position of people: direction and range of the body, and range cues of head and floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import layouts as kp
from ._camera import Camera
from ._depth_cues import HIDDEN_OFFSET, CombinedRange, DepthCue, combined_range
from ._floor import FloorPlane
from ._stages import HeadPose, PersonDetection, PersonKeypoints
from .anthropometry import (
    HEAD_CENTRE_HEAD_M,
    MEAN_STATURE_M,
    STATURE_RELATIVE_STD,
    UNUSUAL_SIZE_LOG_OFFSET,
    UNUSUAL_SIZE_LOG_STD,
    UNUSUAL_SIZE_PROBABILITY,
)
from .arrays import FloatArray
from .body import (
    BOX_LEAST_TRACE_M2,
    BodyPlacement,
    cut_by_border,
    place_bodies,
    place_boxes,
)
from .depth_image import BEHIND_M, Chest, find_chest, trunk_in_image

#: Position (3,) and covariance (3, 3) in the camera frame.
Placement = tuple[FloatArray, FloatArray]

# Probability that each cue is an outlier. "Bottom" is the lower edge of the box.
_BODY_OUTLIER, _BOX_OUTLIER, _HEAD_OUTLIER = 0.03, 0.05, 0.05
_FEET_OUTLIER, _BOTTOM_OUTLIER = 0.10, 0.30
# Pose networks know whole people, and fit one into the part that is seen of somebody whom the lower
# border cuts, knees and feet included: relative standard deviation of a range by either, and the
# probabilities of both to be outliers where the head tells the range.
_CUT_STD: Final = 0.15
_CUT_BODY_OUTLIER, _CUT_LEGS_OUTLIER = 0.30, 0.80
# A surface on the chest's place is that of something else if it hides the chest: its probability is
# the share of the seen keypoints that do not lie on the same body, within these limits.
_CHEST_OUTLIER, _MOST_CHEST_OUTLIER = 0.005, 0.95
# In a box without a skeleton it may be that of what is behind the person.
_BOX_CHEST_OUTLIER: Final = 0.2
# Below a knee the shank is about vertical, for people who stand, walk or sit: from the knee to the
# sole, its standard deviation, and the probability that they kneel, crouch or lift both feet.
_KNEE_M, _KNEE_STD_M, _KNEE_OUTLIER = 0.285 * MEAN_STATURE_M, 0.06, 0.10
# The same from hips and from shoulders, of people who stand.
_HIPS_M, _HIPS_STD_M, _HIPS_OUTLIER = 0.53 * MEAN_STATURE_M, 0.08, 0.35
_NECK_M, _NECK_STD_M, _NECK_OUTLIER = 0.82 * MEAN_STATURE_M, 0.10, 0.40
# Feet that stand on something, or whose view something blocks, seem farther away than they are.
_FEET_OUTLIER_FARTHER: Final = 0.9
_UNUSUAL: Final = (UNUSUAL_SIZE_LOG_STD, UNUSUAL_SIZE_LOG_OFFSET)
# Head sizes vary by about 4 % between adults; their correlation with the stature is about 0.4.
_HEAD_STATURE_STD: Final = 0.4 * 0.04
# Standard deviations of the depth of head or foot relative to the chest: from a lifted skeleton,
# and from a flat one, which does not show how the body leans.
_HEAD_OFFSET_STD_M, _HEAD_OFFSET_FLAT_STD_M = 0.05, 0.09
_FOOT_OFFSET_STD_M, _FOOT_OFFSET_FLAT_STD_M = 0.06, 0.20
# From the chest to the centre of the head along the upright body (0.73 and 0.93 of an average
# stature).
_CHEST_TO_HEAD_M: Final = 0.35
# Height of an ankle above the floor: 0.039 of the stature above the sole of the foot (Drillis and
# Contini), plus three centimetres for the sole of a work shoe. A step lifts it.
_ANKLE_M, _ANKLE_STD_M = 0.10, 0.03
_BOTTOM_STD_M: Final = 0.02
# Distance of the nearer toe, the lowest pixel of a person, ahead of the body's centre line.
_TOE_AHEAD_M, _TOE_AHEAD_STD_M = 0.10, 0.15
# Noise of ankle labels and of the lower edge of a box, as a fraction of the box's height.
_ANKLE_LABEL_STD, _BOTTOM_LABEL_STD = 0.012, 0.02
_SAME_FLOOR_STDS: Final = 1.5
_UP_LEVEL_CAMERA: Final = np.array([0.0, -1.0, 0.0])
_IDENTITY: Final = np.eye(3)


@dataclass(frozen=True, slots=True, eq=False)
class PersonPlace:
    """A person's place by all cues.

    Attributes:
        position_camera_m: (3,) centre line of the body at chest height.
        covariance_m2: (3, 3) of the position.
        lasting_relative_std: the part of the range's relative standard deviation that is the same
            in every image of this person.
        size_range_m: range by the size of the skeleton alone; None for a person without one.
        size_range_relative_std: its relative standard deviation, the stature's part left out.
    """

    position_camera_m: FloatArray
    covariance_m2: FloatArray
    lasting_relative_std: float
    size_range_m: float | None
    size_range_relative_std: float | None


@dataclass(frozen=True, slots=True)
class _Feet:
    """Depths at which both ankles of a person would stand on the floor.

    Attributes:
        depth_m: depth of the left and right ankle; NaN for an ankle that is not seen.
        log_std: standard deviations of the logarithms of the depths.
    """

    depth_m: list[float]
    log_std: list[float]


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """One person in one frame, as it shows them.

    Attributes:
        detection: their box.
        keypoints: what is seen in it.
        head: its pose, if it is known.
        skeleton: the placed body; None without one.
        by_box: the placement by the box; None where the skeleton's is surely more accurate.
        feet: where the ankles would stand on a known floor.
    """

    detection: PersonDetection
    keypoints: PersonKeypoints
    head: HeadPose | None
    skeleton: BodyPlacement | None
    by_box: Placement | None
    feet: _Feet | None


class _Ranged(NamedTuple):
    """A first placement, the range by all cues, and that by the size of the skeleton alone."""

    start: Placement
    found: CombinedRange
    size_range_m: float | None
    size_range_relative_std: float | None


def place_people(
    camera: Camera,
    detections: Sequence[PersonDetection],
    people: tuple[PersonKeypoints, ...],
    heads: Sequence[HeadPose | None],
    floor: FloorPlane | None,
    keypoint_std_px: float,
    min_score: float,
    depth_m: FloatArray | None = None,
    unusual_size_probability: float = UNUSUAL_SIZE_PROBABILITY,
) -> tuple[PersonPlace | None, ...]:
    """Return the place of each person's centre line at chest height; None if unknown.

    The skeleton (limb lengths and all seen keypoints), or the box if that is more accurate, gives
    the direction and a first range. Further cues for the range are the head's range, if its
    estimator measures one, the feet on a known floor, and a depth image (H, W), NaN in its holes.
    :func:`combined_range` combines all cues; any of them may be an outlier, and the person may be
    no adult who stands, with ``unusual_size_probability``.
    """
    if not people:
        return ()
    bodies = place_bodies(camera, tuple(people), keypoint_std_px, min_score)
    feet: Sequence[_Feet | None] = [None] * len(people)
    if floor is not None:
        feet = _feet_on_floor(floor, camera, detections, people, keypoint_std_px, min_score)
    by_boxes = _place_by_boxes(camera, detections, bodies)
    everybody = map(_Seen, detections, people, heads, bodies, by_boxes, feet)
    ranged = [
        _ranged(camera, each, floor, min_score, depth_m, unusual_size_probability)
        for each in everybody
    ]
    places = iter(_with_range([each for each in ranged if each is not None]))
    return tuple(None if each is None else next(places) for each in ranged)


def _place_by_boxes(
    camera: Camera, detections: Sequence[PersonDetection], bodies: Sequence[BodyPlacement | None]
) -> list[Placement | None]:
    """Return placements by boxes, only of people whose body placement may be less accurate."""
    asked = [
        row
        for row, body in enumerate(bodies)
        if body is None or _trace(body.position_covariance_m2) > BOX_LEAST_TRACE_M2
    ]
    placements: list[Placement | None] = [None] * len(bodies)
    if asked:
        found = place_boxes(camera, [detections[row].box_xyxy_px for row in asked])
        for row, place in zip(asked, found, strict=True):
            placements[row] = place
    return placements


def _ranged(
    camera: Camera,
    seen: _Seen,
    floor: FloorPlane | None,
    min_score: float,
    depth_m: FloatArray | None,
    unusual: float,
) -> _Ranged | None:
    """Return the placement of a person with the range of all cues; None if nothing places them."""
    body, start = seen.skeleton, seen.by_box
    # An arm at the image's border gives a less accurate range than the height of its box.
    if body is not None and (
        start is None or _trace(body.position_covariance_m2) <= _trace(start[1])
    ):
        start = body.position_camera_m, body.position_covariance_m2
    else:
        body = None
    if start is None:
        return None
    cues = _range_cues(camera, seen, body, start, floor, min_score)
    by_size = cues[0]
    if depth_m is not None:
        chest = _chest(camera, seen, start[0], depth_m, min_score)
        if chest is not None:
            cues.append(_chest_cue(start[0], chest, seen.skeleton is not None))
    found = combined_range(cues, unusual)
    if body is None:
        return _Ranged(start, found, None, None)
    own = math.sqrt(by_size.log_std**2 - by_size.stature_std**2)
    return _Ranged(start, found, float(np.linalg.norm(start[0])), own)


def _trace(matrix: FloatArray) -> float:
    return float(matrix[0, 0] + matrix[1, 1] + matrix[2, 2])


def _range_cues(
    camera: Camera,
    seen: _Seen,
    body: BodyPlacement | None,
    start: Placement,
    floor: FloorPlane | None,
    min_score: float,
) -> list[DepthCue]:
    """Return the cues of body or box, head and feet for the range, relative to the start's.

    The first one is that of the size of ``body``, or of the box for None.
    """
    position, covariance = start
    x, y, z = position.tolist()
    squared = x * x + y * y + z * z
    along = math.sqrt(max(float(position @ covariance @ position), 1e-9)) / squared
    stature = STATURE_RELATIVE_STD if body is None else body.scale_relative_std
    outlier, legs_outlier, cut_std = _BOX_OUTLIER if body is None else _BODY_OUTLIER, 0.0, 0.0
    head = _head_cue(position, seen, body, floor)
    if body is not None and cut_by_border(camera, seen.detection.box_xyxy_px[None])[1][0]:
        cut_std = _CUT_STD
        along = math.hypot(along, cut_std)
        if head is not None:
            outlier, legs_outlier = _CUT_BODY_OUTLIER, _CUT_LEGS_OUTLIER
    stature = min(stature, STATURE_RELATIVE_STD, 0.99 * along)
    cues = [DepthCue(0.0, along, stature, outlier, *_UNUSUAL, 0.5, HIDDEN_OFFSET * (body is None))]
    if head is not None:
        cues.append(head)
    if floor is not None:
        shown = seen.keypoints.scores[kp.BODY] >= min_score
        if body is not None and seen.feet is not None:
            cue = _feet_cue(seen.keypoints, body, seen.feet) or _legs_cue(body, shown, floor)
        elif shown.any() and not shown[kp.ANKLES].any():
            # The feet are behind something or outside the image, and so is not the lower edge.
            cue = None
        else:
            cue = _bottom_cue(camera, seen.detection, position, floor)
        if cue is not None:
            least = max(cue.outlier_probability, legs_outlier)
            std = math.hypot(cue.log_std, cut_std)
            cues.append(replace(cue, outlier_probability=least, log_std=std))
    return cues


def _trunk_px(camera: Camera, body: BodyPlacement) -> FloatArray | None:
    """Return the neck and the middle of the hips (2, 2) of a placed body in pixels, if seen."""
    points = body.keypoints_camera_m
    ends = camera.project([points[kp.SHOULDERS].mean(axis=0), points[kp.HIPS].mean(axis=0)])
    return ends if np.isfinite(ends).all() else None


def _chest(
    camera: Camera, seen: _Seen, position: FloatArray, depth_m: FloatArray, min_score: float
) -> Chest | None:
    """Return the surface of a person's chest in a depth image, from a first position."""
    body, person = seen.skeleton, seen.keypoints
    direction = position / np.linalg.norm(position)
    trunk_px = None if body is None else _trunk_px(camera, body)
    trunk_px = trunk_in_image(seen.detection, person, trunk_px, min_score)
    rows = np.flatnonzero(person.scores[kp.BODY] >= min_score)
    ahead_m = np.zeros(len(rows))
    if body is not None:
        ahead_m = (body.keypoints_camera_m[rows] - body.position_camera_m) @ direction
    return find_chest(camera, depth_m, direction, trunk_px, person.keypoints_px[rows], ahead_m)


def _chest_cue(position: FloatArray, chest: Chest, has_body: bool) -> DepthCue:
    """Return the cue of the chest's range in a depth image."""
    away_m = max(float(np.linalg.norm(position)), 1e-3)
    range_m = chest.range_m
    if has_body:
        # The chest of a child is less deep: as much as they are smaller.
        range_m -= BEHIND_M * (1.0 - min(max((range_m - BEHIND_M) / away_m, 0.5), 1.0))
    value, std = math.log(range_m / away_m), chest.std_m / range_m
    if not has_body:
        return DepthCue(value, std, 0.0, _BOX_CHEST_OUTLIER, 0.0, 0.0, _FEET_OUTLIER_FARTHER)
    off = 1.0 - (chest.keypoint_share or 0.0)
    return DepthCue(value, std, 0.0, min(max(off, _CHEST_OUTLIER), _MOST_CHEST_OUTLIER))


def _with_range(people: Sequence[_Ranged]) -> list[PersonPlace]:
    """Return the placements with the range of all cues together."""
    if not people:
        return []
    position = np.array([each.start[0] for each in people])
    covariance = np.array([each.start[1] for each in people])
    log_range, log_std = np.array([(e.found.log_range, e.found.log_std) for e in people]).T
    ratio = np.exp(log_range)[:, None]
    squared = (position * position).sum(axis=1)[:, None, None]
    across = ratio[..., None] * (_IDENTITY - position[:, :, None] * position[:, None] / squared)
    placed = ratio * position
    far = log_std[:, None] * placed
    spread = across @ covariance @ across + far[:, :, None] * far[:, None]
    spread = 0.5 * (spread + spread.swapaxes(1, 2))
    return [
        PersonPlace(
            place, own, each.found.lasting_std, each.size_range_m, each.size_range_relative_std
        )
        for place, own, each in zip(placed, spread, people, strict=True)
    ]


def _head_cue(
    position: FloatArray, seen: _Seen, body: BodyPlacement | None, floor: FloorPlane | None
) -> DepthCue | None:
    """Return the cue of the head's measured range for the range of its body."""
    head = seen.head
    if head is None or head.range_relative_std is None:
        return None
    centre = head.position_camera_m + head.rotation_camera_head @ HEAD_CENTRE_HEAD_M
    if body is not None and seen.keypoints.lifted:
        expected = float(body.keypoints_camera_m[:5, 2].mean())
        offset = _HEAD_OFFSET_STD_M
    else:
        up = _UP_LEVEL_CAMERA if floor is None else floor.normal_camera
        expected = float(position[2] + _CHEST_TO_HEAD_M * up[2])
        offset = _HEAD_OFFSET_FLAT_STD_M
    if (measured := float(centre[2])) <= 0.0 or expected <= 0.0:
        return None
    std = math.hypot(head.range_relative_std, offset / expected)
    return DepthCue(
        math.log(measured / expected),
        std,
        min(_HEAD_STATURE_STD, 0.5 * std),
        _HEAD_OUTLIER,
        *_UNUSUAL,
    )


def _feet_on_floor(
    floor: FloorPlane,
    camera: Camera,
    detections: Sequence[PersonDetection],
    people: Sequence[PersonKeypoints],
    keypoint_std_px: float,
    min_score: float,
) -> list[_Feet]:
    """Return the depths at which the seen ankles of each person would stand on the floor."""
    pixels = np.array([person.keypoints_px[kp.ANKLES] for person in people])
    scores = np.array([person.scores[kp.ANKLES] for person in people])
    edge = np.array([camera.width_px - 1.0, camera.height_px - 1.0])
    shown = (scores >= min_score) & ((pixels >= 0.0) & (pixels <= edge)).all(axis=2)
    label_px = [
        math.hypot(keypoint_std_px, _ANKLE_LABEL_STD * float(box[3] - box[1]))
        for box in (detection.box_xyxy_px for detection in detections)
    ]
    depth, std = floor.depth_of(
        camera.normalise(pixels.reshape(-1, 2), nearest=True),
        _ANKLE_M,
        _ANKLE_STD_M,
        np.repeat(label_px, 2) / camera.fy_px,
    )
    depth = np.where(shown, depth.reshape(-1, 2), np.nan)
    return [_Feet(*pair) for pair in zip(depth.tolist(), std.reshape(-1, 2).tolist(), strict=True)]


def _feet_cue(person: PersonKeypoints, body: BodyPlacement, feet: _Feet) -> DepthCue | None:
    """Return the cue of the ankles on the floor: the planted foot, or both where they agree."""
    offset = _FOOT_OFFSET_STD_M if person.lifted else _FOOT_OFFSET_FLAT_STD_M
    ankles = [
        (math.log(found / expected), math.hypot(error, offset / expected))
        for found, error, expected in zip(
            feet.depth_m, feet.log_std, body.keypoints_camera_m[kp.ANKLES, 2].tolist(), strict=True
        )
        if found > 0.0 and expected > 0.0
    ]
    if not ankles:
        return None
    ankles.sort()
    value, error = ankles[0]
    # A raised foot seems farther away than it is, so the nearer one is the planted foot.
    if len(ankles) > 1 and ankles[1][0] - value < _SAME_FLOOR_STDS * error:
        value = 0.5 * (value + ankles[1][0])
    return DepthCue(value, error, 0.0, _FEET_OUTLIER, outlier_farther=_FEET_OUTLIER_FARTHER)


def _legs_cue(body: BodyPlacement, seen: NDArray[np.bool_], floor: FloorPlane) -> DepthCue | None:
    """Return the cue of people whose feet are not seen, from how high the lowest seen joint is.

    A body that is scaled about the camera keeps its pixels. Its soles reach the floor at one scale.
    """
    for rows, above, std, outlier in (
        ((kp.LEFT_KNEE, kp.RIGHT_KNEE), _KNEE_M, _KNEE_STD_M, _KNEE_OUTLIER),
        (kp.HIPS, _HIPS_M, _HIPS_STD_M, _HIPS_OUTLIER),
        (kp.SHOULDERS, _NECK_M, _NECK_STD_M, _NECK_OUTLIER),
    ):
        joints = np.arange(17)[np.array(rows) if isinstance(rows, tuple) else rows]
        shown = joints[seen[joints]].tolist()
        if shown:
            up_m = float((body.keypoints_camera_m[shown] @ floor.normal_camera).min())
            down_m = above - up_m
            if down_m <= 0.1:
                return None
            range_m = float(np.linalg.norm(body.position_camera_m))
            tilted = floor.tilt_std_rad * range_m / down_m
            error = math.hypot(std / down_m, floor.height_std_m / floor.height_m, tilted)
            return DepthCue(math.log(floor.height_m / down_m), error, 0.0, outlier)
    return None


def _bottom_cue(
    camera: Camera, detection: PersonDetection, position: FloatArray, floor: FloorPlane
) -> DepthCue | None:
    """Return the cue of the box's lower edge, as shoes on the floor; None if it is cut off."""
    left, top, right, bottom = detection.box_xyxy_px.tolist()
    if position[2] <= _TOE_AHEAD_M or cut_by_border(camera, detection.box_xyxy_px[None])[1][0]:
        return None
    ray = camera.normalise([[0.5 * (left + right), bottom]], nearest=True)
    ray_std = _BOTTOM_LABEL_STD * (bottom - top) / camera.fy_px
    depth, std = floor.depth_of(ray, 0.0, _BOTTOM_STD_M, ray_std)
    found, expected = float(depth[0]), float(position[2]) - _TOE_AHEAD_M
    if not (found > 0.0 and expected > 0.0):
        return None
    error = math.hypot(float(std[0]), _TOE_AHEAD_STD_M / expected)
    off = math.log(found / expected)
    return DepthCue(off, error, 0.0, _BOTTOM_OUTLIER, hidden_offset=math.inf)
