"""Draws people into a picture: the gaze, α with its standard deviation, box and skeleton."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import numpy as np

from perception import AttentionCone, Camera, PersonKeypoints, PersonObservation
from perception import layouts as kp
from perception.arrays import FloatArray, ImageRgb

from ..drawing import (
    DARK,
    WHITE,
    Colour,
    Font,
    awareness_colour,
    draw_disc,
    draw_line,
    drawable,
    fill_hull,
)
from ._labels import HEAD, SEEN_SCORE, OverlaidPerson, draw_labels

_LEFT: Final[Colour] = (126, 200, 255)
_RIGHT: Final[Colour] = (255, 196, 128)
_BONES: Final = (
    (kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER, WHITE),
    (kp.LEFT_HIP, kp.RIGHT_HIP, WHITE),
    (kp.LEFT_SHOULDER, kp.LEFT_HIP, _LEFT),
    (kp.LEFT_SHOULDER, kp.LEFT_ELBOW, _LEFT),
    (kp.LEFT_ELBOW, kp.LEFT_WRIST, _LEFT),
    (kp.LEFT_HIP, kp.LEFT_KNEE, _LEFT),
    (kp.LEFT_KNEE, kp.LEFT_ANKLE, _LEFT),
    (kp.RIGHT_SHOULDER, kp.RIGHT_HIP, _RIGHT),
    (kp.RIGHT_SHOULDER, kp.RIGHT_ELBOW, _RIGHT),
    (kp.RIGHT_ELBOW, kp.RIGHT_WRIST, _RIGHT),
    (kp.RIGHT_HIP, kp.RIGHT_KNEE, _RIGHT),
    (kp.RIGHT_KNEE, kp.RIGHT_ANKLE, _RIGHT),
)
_FACE: Final = (
    (kp.NOSE, WHITE),
    (kp.LEFT_EYE, _LEFT),
    (kp.RIGHT_EYE, _RIGHT),
    (kp.LEFT_EAR, _LEFT),
    (kp.RIGHT_EAR, _RIGHT),
)
# Lines and letters are made for a picture of this size, and grow with larger ones.
_UNIT_PX2: Final = 640.0 * 480.0
# Lengths of the cone and of the arrow along its axis.
_CONE_LENGTH_M: Final = 0.14
_ARROW_LENGTH_M: Final = 0.34
_RIM_ANGLES: Final = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)[:, None]


def draw_people(
    picture: ImageRgb,
    camera: Camera,
    people: Iterable[OverlaidPerson],
    cone: AttentionCone,
    caption: str = "",
    *,
    text_px: int | None = None,
) -> ImageRgb:
    """Draw boxes, skeletons, attention cones, α with its standard deviation, and distances.

    The colour of box and cone shows α: red is unaware, green aware, grey without evidence. A label
    at each person has a bar with α, a band of one standard deviation and, with a track, a mark at
    the lower bound, which navigation uses.

    Args:
        picture: (H, W, 3) uint8 RGB.
        camera: of the picture.
        people: what is known of each.
        cone: the attention cone.
        caption: of the picture, in a corner.
        text_px: height of a line of text; None for one that fits the size of the picture.

    Returns:
        A new image of the same size.
    """
    image: ImageRgb = picture.copy()
    unit = max(math.sqrt(image.shape[0] * image.shape[1] / _UNIT_PX2), 0.5)
    # Far people first, so that near people are drawn over them.
    far_first = sorted(people, key=lambda each: -float(each.observation.position_camera_m[2]))
    for person in far_first:
        _draw_gaze(image, camera, person, cone, unit)
    for person in far_first:
        if person.keypoints is not None:
            _draw_skeleton(image, person.keypoints, unit)
        _draw_box(image, person.observation, unit)
    font = Font(round(18 * unit) if text_px is None else text_px, weight=450)
    draw_labels(image, far_first[::-1], camera, font, caption)
    return image


def _draw_gaze(
    image: ImageRgb, camera: Camera, person: OverlaidPerson, cone: AttentionCone, unit: float
) -> None:
    """Draw the attention cone and its axis."""
    gaze = person.observation.gaze_camera
    apex = _head_position(camera, person)
    if gaze is None or apex is None:
        return
    colour = awareness_colour(person.observation.awareness)
    # Points behind the camera cannot be drawn, so the cone of a near person is shorter.
    length = min(_CONE_LENGTH_M, 0.5 * float(apex[2]))
    rim = camera.project(np.vstack([apex, apex + length * _cone_rim(gaze, cone.half_angle_rad)]))
    if drawable(rim):
        # The cone of a gaze away from the camera lies behind the body: it is drawn fainter.
        fill_hull(image, rim, colour, 0.16 if gaze[2] < 0.0 else 0.08)
        draw_line(image, np.vstack([rim[1:], rim[1:2]]), colour, 1)
    arrow = min(_ARROW_LENGTH_M, 0.7 * float(apex[2]))
    ray = camera.project(np.stack([apex, apex + arrow * gaze]))
    if drawable(ray):
        for line in (ray, _barbs(ray, unit)):
            draw_line(image, line, DARK, round(4 * unit))
        for line in (ray, _barbs(ray, unit)):
            draw_line(image, line, colour, max(round(2 * unit), 1))
        draw_disc(image, ray[0], 3.0 * unit, colour)
        person.arrow_px = ray


def _cone_rim(gaze: FloatArray, half_angle_rad: float) -> FloatArray:
    """Return the rim (24, 3) of a cone of length 1 along the gaze."""
    side = np.cross(gaze, (0.0, 1.0, 0.0) if abs(gaze[1]) < 0.9 else (1.0, 0.0, 0.0))
    side /= np.linalg.norm(side)
    ring = np.cos(_RIM_ANGLES) * side + np.sin(_RIM_ANGLES) * np.cross(gaze, side)
    return np.asarray(gaze + math.tan(half_angle_rad) * ring)


def _barbs(ray_px: FloatArray, unit: float) -> FloatArray:
    """Return the head (3, 2) of an arrow; an arrow that points at the camera has a small one."""
    along = ray_px[1] - ray_px[0]
    length = max(float(np.hypot(*along)), 1e-6)
    back = -along / length * min(7.0 * unit, 0.5 * length)
    side = 0.6 * np.array([-back[1], back[0]])
    return np.stack([ray_px[1] + back + side, ray_px[1], ray_px[1] + back - side])


def _head_position(camera: Camera, person: OverlaidPerson) -> FloatArray | None:
    """Return the cone's apex (3,): the head's keypoints, else the top of the box, at body depth."""
    keypoints, box = person.keypoints, person.observation.box_xyxy_px
    pixel = None
    if keypoints is not None:
        head = list(HEAD)
        weight = np.where(keypoints.scores[head] >= SEEN_SCORE, keypoints.scores[head], 0.0)
        if weight.sum() > 0.0:
            pixel = weight @ keypoints.keypoints_px[head] / weight.sum()
    if pixel is None:
        if box is None:
            return None
        pixel = np.array([0.5 * (box[0] + box[2]), box[1] + 0.08 * (box[3] - box[1])])
    depth = float(person.observation.position_camera_m[2])
    if depth <= 0.0:
        return None
    return np.append(depth * camera.normalise(pixel[None], nearest=True)[0], depth)


def _draw_skeleton(image: ImageRgb, person: PersonKeypoints, unit: float) -> None:
    """Draw the bones and the face of a person's visible keypoints."""
    points, seen = person.keypoints_px, person.scores >= SEEN_SCORE
    thin, thick = max(round(1.6 * unit), 1), max(round(3.4 * unit), 3)
    bones = [
        (points[[one, other]], colour)
        for one, other, colour in _BONES
        if seen[one] and seen[other] and drawable(points[[one, other]])
    ]
    for ends, _ in bones:
        draw_line(image, ends, DARK, thick)
    for ends, colour in bones:
        draw_line(image, ends, colour, thin)
    for index, colour in _FACE:
        if seen[index] and drawable(points[index]):
            draw_disc(image, points[index], 2.4 * unit, DARK)
            draw_disc(image, points[index], 1.6 * unit, colour)


def _draw_box(image: ImageRgb, observation: PersonObservation, unit: float) -> None:
    """Draw the corners of the box, which hide less of the image than all of it."""
    box = observation.box_xyxy_px
    if box is None or not drawable(box):
        return
    # Boxes count from the image's corner, OpenCV from the centre of the first pixel.
    left, top, right, bottom = (box - 0.5).tolist()
    arm = max(min(0.22 * (right - left), 0.22 * (bottom - top), 26.0 * unit), 2.0)
    colour = awareness_colour(observation.awareness)
    for u, v, du, dv in (
        (left, top, arm, arm),
        (right, top, -arm, arm),
        (right, bottom, -arm, -arm),
        (left, bottom, arm, -arm),
    ):
        corner = [(u + du, v), (u, v), (u, v + dv)]
        draw_line(image, corner, DARK, round(4 * unit))
        draw_line(image, corner, colour, max(round(2 * unit), 1))
