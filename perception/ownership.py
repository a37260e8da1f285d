"""The person whom keypoints and heads belong to.

One skeleton for each detection, only one that a body could have, and only a head that its neck
could carry. Boxes are (4,) left, top, right, bottom in pixels.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import layouts as kp
from ._camera import Camera
from ._stages import HeadPose, PersonDetection, PersonKeypoints
from .arrays import FloatArray, median_of
from .evidence import AwarenessReason


def extent(points: FloatArray, seen: NDArray[np.bool_]) -> FloatArray:
    """Return the box (4,) of the seen ones of points (K, 2), of which there is at least one."""
    shown = points[seen]
    return np.concatenate([shown.min(axis=0), shown.max(axis=0)])


def area(box: FloatArray) -> float:
    """Return the area of a box; 0 if it has no extent."""
    left, top, right, bottom = box.tolist()
    return float(max(right - left, 0.0) * max(bottom - top, 0.0))


def common_area(first: FloatArray, second: FloatArray) -> float:
    """Return the area that two boxes share."""
    low, high = np.maximum(first[:2], second[:2]), np.minimum(first[2:], second[2:])
    across, down = (high - low).tolist()
    return float(max(across, 0.0) * max(down, 0.0))


def iou(first: FloatArray, second: FloatArray) -> float:
    """Return the intersection over union of two boxes."""
    common = common_area(first, second)
    return common / max(area(first) + area(second) - common, 1e-9)


#: The reasons that this module gives; the last one is about the head alone.
DISOWNED: Final[tuple[AwarenessReason, ...]] = (
    "skeleton of another person",
    "keypoints outside the box",
    "no body has such limbs",
    "head of another person",
)


class FoundPerson(NamedTuple):
    """A person in an image.

    Attributes:
        detection: their box.
        keypoints: what the pose estimator found in it.
        disowned: why the keypoints are not the person's, one of :data:`DISOWNED`; None if they are.
    """

    detection: PersonDetection
    keypoints: PersonKeypoints
    disowned: AwarenessReason | None


#: (17,) or (P, 17) which keypoints are seen.
Seen = NDArray[np.bool_]

# Two skeletons are one if the median distance between their points is below this share of the size
# of the smaller one, and if they share so many points.
_SAME_SHARE: Final = 0.06
# The same for two skeletons with one head.
_ALIKE_SHARE: Final = 0.25
_FEWEST_COMMON: Final = 5
# Two heads are one if the median distance of their points is below this, at the body's own scale,
# and if they share so many points.
_SAME_HEAD_M: Final = 0.06
_FEWEST_OF_HEAD: Final = 2
# More than this share of the keypoints must lie in the box, padded by this share of its size: arms
# and feet often reach beyond a box.
_INSIDE_SHARE: Final = 0.6
_PADDING: Final = 0.2
# Lengths (m) of an adult's segments, shoulders to hips, and their ends: the largest of them in
# pixels per metre is foreshortened least.
_SEGMENTS: Final = (
    (0.50, (5, 6), (11, 12)),
    (0.36, (5,), (6,)),
    (0.28, (5,), (7,)),
    (0.28, (6,), (8,)),
    (0.25, (7,), (9,)),
    (0.25, (8,), (10,)),
    (0.42, (11,), (13,)),
    (0.42, (12,), (14,)),
    (0.42, (13,), (15,)),
    (0.42, (14,), (16,)),
)
_LENGTHS_M: Final = np.array([length for length, *_ in _SEGMENTS])
# (segments, 17) end minus start of each, and 1 where one uses a keypoint.
_ENDS: Final = np.array(
    [
        [(row in end) / len(end) - (row in start) / len(start) for row in range(17)]
        for _, start, end in _SEGMENTS
    ]
)
_USES: Final = (_ENDS != 0.0).astype(np.int64)
# No limb is so many times longer than the next one says, and no head is farther from the shoulders.
_LONGEST_RATIO: Final = 2.0
_NECK_M: Final = 0.55
# From the middle of the shoulders to that of nose, eyes and ears, away from the hips.
_HEAD_ABOVE_M: Final = 0.22
_UP_CAMERA: Final = np.array([0.0, -1.0, 0.0])
# Of a head that looks towards the camera: no neck turns farther from shoulders and hips, which are
# so wide, and no nose, eyes and ears lie farther from the middle of the shoulders.
_MOST_NECK_TURN_RAD: Final = math.radians(95.0)
_SHOULDERS_M, _HIPS_M = 0.36, 0.16
_FACE_FROM_NECK_M: Final = 0.28
# How many times nearer than its shoulders a head may seem, and how far its middle may lie outside
# the box of its body, as a share of the box's smaller side.
_NEARER: Final = 1.5
_HEAD_OUTSIDE: Final = 0.05
# Shoulders with this share of the score of seen points still tell whose head it is.
_SHOULDERS_SHARE: Final = 0.5


def disowned_keypoints(
    camera: Camera,
    detections: Sequence[PersonDetection],
    people: Sequence[PersonKeypoints],
    min_score: float,
) -> list[AwarenessReason | None]:
    """Return for each person why the keypoints are not theirs, or None.

    Of two detections with one skeleton, that keeps it whose box fits it better; a skeleton fits a
    box by the overlap of the box with that of the seen keypoints, times the detection's score.
    Of two skeletons with one head, that keeps it on whose neck it sits better.

    Args:
        camera: camera of the image. Limbs are compared by their angles, which a wide lens leaves as
            they are.
        detections: one per person.
        people: their keypoints.
        min_score: keypoints with a lower score count as not seen.
    """
    if not people:
        return []
    points = np.array([person.keypoints_px[kp.BODY] for person in people])
    seen = np.array([person.scores[kp.BODY] for person in people]) >= min_score
    boxes = np.array([detection.box_xyxy_px for detection in detections])
    rays = _unit_rays(camera, points)
    scales = _scales(rays, seen)
    reasons = _implausible(points, rays, seen, boxes, scales)
    rows = [row for row in range(len(people)) if seen[row].any()]
    rows = [row for row in rows if reasons[row] is None]
    if len(rows) < 2:
        return reasons
    fits = {row: _fit(points[row], seen[row], detections[row]) for row in rows}
    # The best fit keeps what it has; those after it must differ from all before.
    kept: list[int] = []
    for row in sorted(rows, key=lambda each: -fits[each]):
        heads = [_have_one_head(rays, seen, scales, row, other) for other in kept]
        if any(
            _apart(points, seen, row, other) < (_ALIKE_SHARE if one_head else _SAME_SHARE)
            for other, one_head in zip(kept, heads, strict=True)
        ):
            reasons[row] = "skeleton of another person"
            continue
        for other in itertools.compress(kept, heads):
            off_m = [_head_off_m(rays[each], seen[each], scales[each]) for each in (row, other)]
            reasons[row if off_m[0] >= off_m[1] else other] = "head of another person"
        kept.append(row)
    return reasons


def own_heads(
    camera: Camera,
    found: Sequence[FoundPerson],
    heads: Sequence[HeadPose | None],
    min_score: float,
) -> tuple[tuple[FoundPerson, ...], tuple[HeadPose | None, ...]]:
    """Return people and heads without the heads that look here and are not the person's own.

    A pose network puts nose and eyes on the best face that it sees: of a neighbour, or on a
    photograph. Such a head often lies outside the box of the body, farther than 0.28 m from the
    middle of the shoulders, or looks at the camera over a trunk that turns its back: left shoulder
    and hip at the image's left. Nobody turns the head by more than 95° from the trunk. A head that
    looks away is left as it is: whoever it belongs to, it is unaware. Without both shoulders only
    the box tells.

    Args:
        camera: camera of the image.
        found: people.
        heads: one per person; None where there is none.
        min_score: keypoints with a lower score count as not seen.
    """
    people, own = list(found), list(heads)
    for row, (one, head) in enumerate(zip(found, heads, strict=True)):
        if head is None or one.disowned is not None:
            continue
        if _is_anothers(camera, one, head, min_score):
            keypoints = without_disowned(one.keypoints, DISOWNED[-1])
            people[row] = one._replace(keypoints=keypoints, disowned=DISOWNED[-1])
            own[row] = None
    return tuple(people), tuple(own)


def _is_anothers(camera: Camera, one: FoundPerson, head: HeadPose, min_score: float) -> bool:
    """Return whether a head looks towards the camera that this body cannot carry."""
    person, box = one.keypoints, one.detection.box_xyxy_px
    shown = person.scores[kp.HEAD] >= min_score
    away = float(head.gaze_camera @ head.position_camera_m)
    if away >= 0.0:
        return False
    if shown.any():
        middle = person.keypoints_px[kp.HEAD][shown].mean(axis=0)
        outside = np.maximum(box[:2] - middle, middle - box[2:]).max()
        if outside > _HEAD_OUTSIDE * float((box[2:] - box[:2]).min()):
            return True
    seen = person.scores[kp.BODY] >= min_score
    seen[kp.SHOULDERS] = person.scores[kp.SHOULDERS] >= _SHOULDERS_SHARE * min_score
    if not seen[kp.SHOULDERS].all():
        return False
    rays = _unit_rays(camera, person.keypoints_px[None, kp.BODY])
    (scales,) = _scales(rays, seen[None])
    rays, scale = rays[0], max(scales)
    neck = rays[kp.SHOULDERS].mean(axis=0)
    if shown.any():
        off = rays[kp.HEAD][shown].mean(axis=0) - neck
        near = scale
        if head.range_relative_std is not None:
            # Pose networks put the shoulders of near people low and their bodies too far away.
            measured = 1.0 / float(np.linalg.norm(head.position_camera_m))
            near = max(scale, min(measured, _NEARER * scale))
        if float(np.linalg.norm(off)) > _FACE_FROM_NECK_M * near:
            return True
    up, left, wide_m = _UP_CAMERA, rays[kp.LEFT_SHOULDER] - rays[kp.RIGHT_SHOULDER], _SHOULDERS_M
    if seen[kp.HIPS].all():
        up = neck - rays[kp.HIPS].mean(axis=0)
        left, wide_m = left + rays[kp.LEFT_HIP] - rays[kp.RIGHT_HIP], wide_m + _HIPS_M
    right = np.cross(neck, up)
    across = float(left @ right) / max(float(np.linalg.norm(right)) * scale, 1e-9)
    torso_rad = math.acos(min(max(across / wide_m, -1.0), 1.0))
    return torso_rad - head.off_camera_rad > _MOST_NECK_TURN_RAD


def without_disowned(person: PersonKeypoints, reason: AwarenessReason | None) -> PersonKeypoints:
    """Return the keypoints with score 0 where they are not the person's."""
    if reason is None:
        return person
    scores = person.scores.copy()
    scores[kp.HEAD if reason == DISOWNED[-1] else slice(None)] = 0.0
    return replace(person, scores=scores)


def _unit_rays(camera: Camera, points: FloatArray) -> FloatArray:
    """Return unit vectors (P, 17, 3) towards the points (P, 17, 2) of each person."""
    rays = np.ones((len(points), 17, 3))
    rays[..., :2] = camera.normalise(points.reshape(-1, 2), nearest=True).reshape(-1, 17, 2)
    return np.asarray(rays / np.sqrt((rays * rays).sum(axis=2, keepdims=True)))


def _implausible(
    points: FloatArray,
    rays: FloatArray,
    seen: Seen,
    boxes: FloatArray,
    scales: Sequence[Sequence[float]],
) -> list[AwarenessReason | None]:
    """Return for each box (P, 4) why no person in it has these points (P, 17, 2), or None.

    There is no reason for somebody of whom no point is seen.
    """
    pad = _PADDING * (boxes[:, 2:] - boxes[:, :2])
    low, high = (boxes[:, :2] - pad)[:, None], (boxes[:, 2:] + pad)[:, None]
    inside = ((points >= low) & (points <= high)).all(axis=2) & seen
    shares = inside.sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    heads = seen[:, kp.HEAD]
    count = heads.sum(axis=1)
    head = (rays[:, kp.HEAD] * heads[..., None]).sum(axis=1) / np.maximum(count, 1)[:, None]
    off = head - rays[:, kp.SHOULDERS].mean(axis=1)
    away = np.sqrt((off * off).sum(axis=1))
    shown = (count > 0) & seen[:, kp.SHOULDERS].all(axis=1)
    reasons: list[AwarenessReason | None] = [None] * len(points)
    for row, (share, has_neck, neck_to_head, unsorted) in enumerate(
        zip(shares.tolist(), shown.tolist(), away.tolist(), scales, strict=True)
    ):
        ordered = sorted(unsorted)
        if share < _INSIDE_SHARE and seen[row].any():
            reasons[row] = "keypoints outside the box"
        elif (len(ordered) >= 3 and ordered[-1] > _LONGEST_RATIO * ordered[-2]) or (
            len(ordered) >= 2 and has_neck and neck_to_head > _NECK_M * ordered[-1]
        ):
            reasons[row] = "no body has such limbs"
    return reasons


def _scales(rays: FloatArray, seen: Seen) -> list[list[float]]:
    """Return radians per metre by each segment whose ends are seen, for each person."""
    ends = _ENDS @ rays
    angles = np.sqrt((ends * ends).sum(axis=2)) / _LENGTHS_M
    complete = ~seen @ _USES.T == 0
    return [
        list(itertools.compress(*row))
        for row in zip(angles.tolist(), complete.tolist(), strict=True)
    ]


def _head_off_m(rays: FloatArray, seen: Seen, scales: Sequence[float]) -> float:
    """Return the distance of the head from its place above the trunk; infinite if unknown."""
    head = seen[kp.HEAD]
    if not (head.any() and seen[kp.SHOULDERS].all() and scales):
        return np.inf
    neck = rays[kp.SHOULDERS].mean(axis=0)
    up = neck - rays[kp.HIPS].mean(axis=0) if seen[kp.HIPS].all() else _UP_CAMERA
    expected = neck + _HEAD_ABOVE_M * max(scales) * up / max(float(np.linalg.norm(up)), 1e-9)
    return float(np.linalg.norm(rays[kp.HEAD][head].mean(axis=0) - expected)) / max(scales)


def _fit(points: FloatArray, seen: Seen, detection: PersonDetection) -> float:
    """Return how well seen points fit a detection: their boxes' overlap times its score."""
    return iou(extent(points, seen), detection.box_xyxy_px) * detection.score


def _apart(points: FloatArray, seen: Seen, row: int, other: int) -> float:
    """Return the median distance of the points of two people, as a share of the smaller size.

    It is infinite if too few points are seen of both.
    """
    common = seen[row] & seen[other]
    if np.count_nonzero(common) < _FEWEST_COMMON:
        return math.inf
    away = np.sqrt(((points[row] - points[other])[common] ** 2).sum(axis=1))
    extents = []
    for each in (row, other):
        shown = points[each][seen[each]]
        extents.append((shown.max(axis=0) - shown.min(axis=0)).tolist())
    return median_of(away.tolist()) / max(min(math.sqrt(w * h) for w, h in extents), 1e-9)


def _have_one_head(
    rays: FloatArray, seen: Seen, scales: Sequence[Sequence[float]], row: int, other: int
) -> bool:
    """Return whether the heads of two people lie in one place."""
    common = (seen[row] & seen[other])[kp.HEAD]
    both = [*scales[row], *scales[other]]
    if np.count_nonzero(common) < _FEWEST_OF_HEAD or not both:
        return False
    apart = (rays[row, kp.HEAD] - rays[other, kp.HEAD])[common]
    return median_of(np.sqrt((apart * apart).sum(axis=1)).tolist()) < _SAME_HEAD_M * max(both)
