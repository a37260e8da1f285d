"""Where a person is: the body's own placement, corrected in range by head and floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from . import layouts as kp
from ._camera import Camera
from ._depth_cues import DepthCue, combine_cues
from ._detection import PersonDetection
from ._floor import FloorPlane
from ._head_pose import HeadPose
from ._keypoints import PersonKeypoints
from .anthropometry import HEAD_CENTRE_HEAD_M, STATURE_RELATIVE_STD
from .arrays import FloatArray
from .body import BOX_LEAST_TRACE_M2, BodyPlacement, place_bodies, place_boxes

Placement = tuple[FloatArray, FloatArray]

_ANKLES: Final = slice(kp.LEFT_ANKLE, kp.RIGHT_ANKLE + 1)

# How often each cue is simply wrong.
_BODY_WRONG, _BOX_WRONG, _HEAD_WRONG, _FEET_WRONG, _BOTTOM_WRONG = 0.03, 0.05, 0.05, 0.10, 0.30
# Heads vary by about 4 % between adults and follow the stature loosely (correlation about 0.4).
_HEAD_STATURE_STD: Final = 0.4 * 0.04
# Depth of head or foot against the chest: as lifted, and where nothing says how the body leans.
_HEAD_OFFSET_STD_M, _HEAD_OFFSET_FLAT_STD_M = 0.05, 0.09
_FOOT_OFFSET_STD_M, _FOOT_OFFSET_FLAT_STD_M = 0.06, 0.20
# From chest to head centre along the upright body (0.93 and 0.73 of an average stature).
_CHEST_TO_HEAD_M: Final = 0.35
# An ankle stands 0.039 of the stature above the sole of the foot (Drillis and Contini), a work
# shoe's sole adds three centimetres, and a step lifts it.
_ANKLE_M, _ANKLE_STD_M = 0.10, 0.03
_BOTTOM_STD_M: Final = 0.02
# The lowest pixel of a person is the nearer toe, not the middle of the body.
_TOE_AHEAD_M, _TOE_AHEAD_STD_M = 0.10, 0.15
# Noise of ankle labels and of the lower edge of a box, in parts of the box's height.
_ANKLE_LABEL_STD, _BOTTOM_LABEL_STD = 0.012, 0.02
# Boxes of detectors end a little short of the border that cuts them off, in parts of the height.
_BORDER: Final = 0.03
_SAME_FLOOR_STDS: Final = 1.5
_UP_LEVEL_CAMERA: Final = np.array([0.0, -1.0, 0.0])
_IDENTITY: Final = np.eye(3)


@dataclass(frozen=True, slots=True)
class _Feet:
    """Of both ankles, the depth at which each would stand on the floor (NaN if unseen)."""

    depth_m: list[float]
    log_std: list[float]


def place_people(
    camera: Camera,
    detections: Sequence[PersonDetection],
    people: Sequence[PersonKeypoints],
    heads: Sequence[HeadPose | None],
    floor: FloorPlane | None,
    keypoint_std_px: float,
    min_score: float,
) -> tuple[Placement | None, ...]:
    """Return position (3,) and covariance (3, 3) of the body's centre line at chest height.

    The skeleton's translation (limb lengths and all seen keypoints, or the box where that says
    more) gives the direction and a first range. The head's own range, where its estimator measured
    one, and the feet on a known floor are further opinions about the range;
    :func:`combine_cues` weighs them and lets any of them be wrong.
    """
    if not people:
        return ()
    bodies = place_bodies(camera, people, keypoint_std_px, min_score)
    boxes = _boxes(camera, detections, bodies)
    feet: Sequence[_Feet | None] = [None] * len(people)
    if floor is not None:
        feet = _feet_on(floor, camera, detections, people, keypoint_std_px, min_score)
    placed: list[Placement | None] = [None] * len(people)
    moves: list[tuple[int, Placement, list[DepthCue]]] = []
    for row, (body, boxed) in enumerate(zip(bodies, boxes, strict=True)):
        body, start = _first(body, boxed)  # noqa: PLW2901 - a body that says too little goes
        if start is None:
            continue
        placed[row] = start
        opinions = _opinions(
            camera, detections[row], people[row], body, start, heads[row], floor, feet[row]
        )
        if len(opinions) > 1:
            moves.append((row, start, opinions))
    if moves:
        rows, starts, cues = zip(*moves, strict=True)
        for row, moved in zip(rows, _moved(starts, cues), strict=True):
            placed[row] = moved
    return tuple(placed)


def _boxes(
    camera: Camera, detections: Sequence[PersonDetection], bodies: Sequence[BodyPlacement | None]
) -> list[Placement | None]:
    """What the boxes say, of those people alone for whom it can matter."""
    asked = [
        row
        for row, body in enumerate(bodies)
        if body is None or _trace(body.position_covariance_m2) > BOX_LEAST_TRACE_M2
    ]
    boxes: list[Placement | None] = [None] * len(bodies)
    if asked:
        found = place_boxes(camera, [detections[row].box_xyxy_px for row in asked])
        for row, place in zip(asked, found, strict=True):
            boxes[row] = place
    return boxes


def _first(
    body: BodyPlacement | None, boxed: Placement | None
) -> tuple[BodyPlacement | None, Placement | None]:
    """Where a person is by body or box, and the body if it is the one that counts."""
    if body is None:
        return None, boxed
    # An arm at the image border says less about the range than the height of its box.
    if boxed is not None and _trace(body.position_covariance_m2) > _trace(boxed[1]):
        return None, boxed
    return body, (body.position_camera_m, body.position_covariance_m2)


def _trace(matrix: FloatArray) -> float:
    return float(matrix[0, 0] + matrix[1, 1] + matrix[2, 2])


def _opinions(
    camera: Camera,
    detection: PersonDetection,
    person: PersonKeypoints,
    body: BodyPlacement | None,
    start: Placement,
    head: HeadPose | None,
    floor: FloorPlane | None,
    feet: _Feet | None,
) -> list[DepthCue]:
    """What body or box, head and feet say about a person's range, against that of the start."""
    position, covariance = start
    x, y, z = position.tolist()
    squared = x * x + y * y + z * z
    along = math.sqrt(max(float(position @ covariance @ position), 1e-9)) / squared
    stature = STATURE_RELATIVE_STD if body is None else body.scale_relative_std
    wrong = _BOX_WRONG if body is None else _BODY_WRONG
    cues = [DepthCue(0.0, along, min(stature, STATURE_RELATIVE_STD, 0.99 * along), wrong)]
    if (cue := _head_cue(position, person, body, head, floor)) is not None:
        cues.append(cue)
    if floor is not None:
        # A body whose ankles do not show stands behind something or beyond the picture's border;
        # the lower edge of its box is not its feet.
        if body is None or feet is None:
            cue = _bottom_cue(camera, detection, position, floor)
        else:
            cue = _feet_cue(person, body, feet)
        if cue is not None:
            cues.append(cue)
    return cues


def _moved(starts: Sequence[Placement], cues: Sequence[Sequence[DepthCue]]) -> list[Placement]:
    """Placements with their ranges replaced by what all cues say together."""
    position = np.array([start[0] for start in starts])
    covariance = np.array([start[1] for start in starts])
    log_range, log_std = np.array([combine_cues(opinions) for opinions in cues]).T
    ratio = np.exp(log_range)[:, None]
    squared = (position * position).sum(axis=1)[:, None, None]
    across = ratio[..., None] * (_IDENTITY - position[:, :, None] * position[:, None] / squared)
    placed = ratio * position
    far = log_std[:, None] * placed
    spread = across @ covariance @ across + far[:, :, None] * far[:, None]
    spread = 0.5 * (spread + spread.swapaxes(1, 2))
    return list(zip(placed, spread, strict=True))


def _head_cue(
    position: FloatArray,
    person: PersonKeypoints,
    body: BodyPlacement | None,
    head: HeadPose | None,
    floor: FloorPlane | None,
) -> DepthCue | None:
    """What the measured range of the head says about the range of the body under it."""
    if head is None or head.range_relative_std is None:
        return None
    centre = head.position_camera_m + head.rotation_camera_head @ HEAD_CENTRE_HEAD_M
    if body is not None and person.lifted:
        expected = float(body.keypoints_camera_m[:5, 2].mean())
        offset = _HEAD_OFFSET_STD_M
    else:
        up = _UP_LEVEL_CAMERA if floor is None else floor.normal_camera
        expected = float(position[2] + _CHEST_TO_HEAD_M * up[2])
        offset = _HEAD_OFFSET_FLAT_STD_M
    measured = float(centre[2])
    if measured <= 0.0 or expected <= 0.0:
        return None
    std = math.hypot(head.range_relative_std, offset / expected)
    return DepthCue(
        math.log(measured / expected), std, min(_HEAD_STATURE_STD, 0.5 * std), _HEAD_WRONG
    )


def _feet_on(
    floor: FloorPlane,
    camera: Camera,
    detections: Sequence[PersonDetection],
    people: Sequence[PersonKeypoints],
    keypoint_std_px: float,
    min_score: float,
) -> list[_Feet]:
    """Depths at which the seen ankles of each person would stand on the floor, and their errors."""
    pixels = np.array([person.keypoints_px[_ANKLES] for person in people])
    scores = np.array([person.scores[_ANKLES] for person in people])
    edge = np.array([camera.width_px - 1.0, camera.height_px - 1.0])
    shown = (scores >= min_score) & ((pixels >= 0.0) & (pixels <= edge)).all(axis=2)
    label_px = [
        math.hypot(keypoint_std_px, _ANKLE_LABEL_STD * float(box[3] - box[1]))
        for box in (detection.box_xyxy_px for detection in detections)
    ]
    depth, std = floor.depth_of(
        camera.normalise(pixels.reshape(-1, 2)),
        _ANKLE_M,
        _ANKLE_STD_M,
        np.repeat(label_px, 2) / camera.fy_px,
    )
    depth = np.where(shown, depth.reshape(-1, 2), np.nan)
    return [_Feet(*pair) for pair in zip(depth.tolist(), std.reshape(-1, 2).tolist(), strict=True)]


def _feet_cue(person: PersonKeypoints, body: BodyPlacement, feet: _Feet) -> DepthCue | None:
    """The ankles on a floor: the planted foot, or both where they agree."""
    offset = _FOOT_OFFSET_STD_M if person.lifted else _FOOT_OFFSET_FLAT_STD_M
    opinions = [
        (math.log(found / expected), math.hypot(error, offset / expected))
        for found, error, expected in zip(
            feet.depth_m, feet.log_std, body.keypoints_camera_m[_ANKLES, 2].tolist(), strict=True
        )
        if found > 0.0 and expected > 0.0
    ]
    if not opinions:
        return None
    opinions.sort()
    value, error = opinions[0]
    # A raised foot looks farther away than it is, so the nearer one is the planted one.
    if len(opinions) > 1 and opinions[1][0] - value < _SAME_FLOOR_STDS * error:
        value = 0.5 * (value + opinions[1][0])
    return DepthCue(value, error, 0.0, _FEET_WRONG)


def _bottom_cue(
    camera: Camera, detection: PersonDetection, position: FloatArray, floor: FloorPlane
) -> DepthCue | None:
    """The lower edge of a box that the image does not cut off, taken for shoes on the floor."""
    left, top, right, bottom = detection.box_xyxy_px.tolist()
    if bottom > (1.0 - _BORDER) * camera.height_px or position[2] <= _TOE_AHEAD_M:
        return None
    ray = camera.normalise([[0.5 * (left + right), bottom]])
    ray_std = _BOTTOM_LABEL_STD * (bottom - top) / camera.fy_px
    depth, std = floor.depth_of(ray, 0.0, _BOTTOM_STD_M, ray_std)
    found, expected = float(depth[0]), float(position[2]) - _TOE_AHEAD_M
    if not (found > 0.0 and expected > 0.0):
        return None
    error = math.hypot(float(std[0]), _TOE_AHEAD_STD_M / expected)
    return DepthCue(math.log(found / expected), error, 0.0, _BOTTOM_WRONG)
