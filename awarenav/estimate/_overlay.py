"""Draws estimates into their images, and these into a video, a folder or a file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from perception import AttentionCone, Camera, PersonKeypoints, PersonObservation
from perception import layouts as kp
from perception.arrays import FloatArray, ImageRgb
from tracking import PersonTrack

from ..drawing import (
    DARK,
    WHITE,
    Colour,
    Font,
    awareness_colour,
    darken_box,
    draw_disc,
    draw_line,
    drawable,
    fill_hull,
)
from ..errors import AwarenavError, MissingExtraError
from ..files import atomic_path
from ._estimator import FrameEstimate
from ._labels import Box, Labelled, Place, Size, leader, meet, place_labels
from ._pictures import IMAGE_SUFFIXES

if TYPE_CHECKING:
    from ..video import VideoWriter

# A folder with one of these suffixes would be a mistake.
_FILE_SUFFIXES: Final = (*IMAGE_SUFFIXES, ".avi", ".gif", ".mkv", ".mov", ".webm")
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
# Keypoints with a lower score are not drawn.
_SEEN_SCORE: Final = 0.3
# Lines and letters are made for a picture of this size, and grow with larger ones.
_UNIT_PX2: Final = 640.0 * 480.0
# Lengths of the cone and of the arrow along its axis.
_CONE_LENGTH_M: Final = 0.14
_ARROW_LENGTH_M: Final = 0.34
_RIM_ANGLES: Final = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)[:, None]

_HEAD: Final = range(kp.NOSE, kp.RIGHT_EAR + 1)


@dataclass(slots=True)
class _Person:
    """A person to draw, and what is known of them.

    ``arrow_px`` (2, 2) is the gaze, from the head on; None until it is drawn.
    """

    observation: PersonObservation
    keypoints: PersonKeypoints | None
    track: PersonTrack | None
    arrow_px: FloatArray | None = None


def draw_overlay(estimate: FrameEstimate, cone: AttentionCone) -> ImageRgb:
    """Draw boxes, skeletons, attention cones, α with its standard deviation, and distances.

    The colour of box and cone shows α: red is unaware, green aware, grey without evidence. A label
    at each person has a bar with α, a band of one standard deviation and, with a tracker, a mark at
    the lower bound, which navigation uses.

    Args:
        estimate: of a frame that has an image.
        cone: the attention cone.

    Returns:
        A new image of the same size.
    """
    assert estimate.frame.image_rgb is not None
    image: ImageRgb = estimate.frame.image_rgb.copy()
    picture = image.shape[1], image.shape[0]
    unit = max(math.sqrt(picture[0] * picture[1] / _UNIT_PX2), 0.5)
    tracks = {track.id: track for track in estimate.tracks or ()}
    people = [
        _Person(observation, keypoints, None if track_id is None else tracks.get(track_id))
        for observation, keypoints, track_id in zip(
            estimate.observations, estimate.keypoints, estimate.track_ids, strict=True
        )
    ]
    # Far people first, so that near people are drawn over them.
    people.sort(key=lambda each: -float(each.observation.position_camera_m[2]))
    for person in people:
        _draw_gaze(image, estimate.camera, person, cone, unit)
    for person in people:
        if person.keypoints is not None:
            _draw_skeleton(image, person.keypoints, unit)
        _draw_box(image, person.observation, unit)
    font, near_first = Font(round(18 * unit)), people[::-1]
    labelled = [_labelled(person, estimate.camera, font, picture) for person in near_first]
    caption = _draw_caption(image, estimate, font, [each.head for each in labelled])
    places = place_labels(labelled, picture, [caption])
    for person, place, own in zip(near_first, places, labelled, strict=True):
        if place is not None:
            ends = leader(place.box, own.head)
            if math.dist(*ends) > font.height_px:
                draw_line(image, ends, awareness_colour(person.observation.awareness), 1)
            _draw_label(image, person, place, font)
    return image


def _draw_gaze(
    image: ImageRgb, camera: Camera, person: _Person, cone: AttentionCone, unit: float
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


def _head_position(camera: Camera, person: _Person) -> FloatArray | None:
    """Return the cone's apex (3,): the head's keypoints, else the top of the box, at body depth."""
    keypoints, box = person.keypoints, person.observation.box_xyxy_px
    pixel = None
    if keypoints is not None:
        head = list(_HEAD)
        weight = np.where(keypoints.scores[head] >= _SEEN_SCORE, keypoints.scores[head], 0.0)
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
    points, seen = person.keypoints_px, person.scores >= _SEEN_SCORE
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


def _texts(person: _Person) -> tuple[tuple[str, ...], ...]:
    """Return the rows of a person's label, the smallest label first."""
    observation, track = person.observation, person.track
    alpha, spread = observation.awareness, observation.awareness_std
    name = "" if track is None else f"#{track.id} "
    distance = f"{np.linalg.norm(observation.position_camera_m):.1f} m"
    distance = distance if track is None else f"#{track.id} · {distance}"
    if alpha is None:
        why = observation.awareness_reason or "no evidence"
        return (f"{name}no α",), (f"{name}{why}",), (distance, f"no α: {why}")
    value = f"α {alpha:.2f}"
    return (f"{name}{value}",), (distance, f"{value} ± {spread:.2f}")


def _labelled(person: _Person, camera: Camera, font: Font, picture: Size) -> Labelled:
    """Return where a person and their head are, and how large their label is."""
    box = person.observation.box_xyxy_px
    if box is None:
        u, v = camera.project(person.observation.position_camera_m[None])[0].tolist()
        box = np.array([u, v, u, v]) if math.isfinite(u) else np.zeros(4)
    return Labelled(
        _inside(box, picture),
        _inside(_head_px(box, person.keypoints), picture),
        _label_sizes(person, font),
        None if person.arrow_px is None else _inside(_around(person.arrow_px), picture),
    )


def _head_px(box: FloatArray, keypoints: PersonKeypoints | None) -> FloatArray:
    """Return the box (4,) around a head: around its keypoints, else the top fifth of the person."""
    height = box[3] - box[1]
    if keypoints is not None:
        points = keypoints.keypoints_px[list(_HEAD)][keypoints.scores[list(_HEAD)] >= _SEEN_SCORE]
        if len(points):
            around = _around(points)
            # From ear to ear a head is two thirds of its height; a profile shows less.
            wide = float((around[2:] - around[:2]).max())
            margin = max(0.75 * wide, 0.06 * height)
            return np.asarray(around + np.array([-margin, -margin, margin, margin]))
    return np.array([box[0], box[1], box[2], box[1] + 0.2 * height])


def _around(points: FloatArray) -> FloatArray:
    return np.concatenate([points.min(axis=0), points.max(axis=0)])


def _inside(box: FloatArray, picture: Size) -> Box:
    """Return the part of a box (4,) in the picture, in whole pixels."""
    limits = (picture[0], picture[1])
    left, top = (int(np.clip(math.floor(box[k]), 0, limits[k])) for k in (0, 1))
    right, bottom = (int(np.clip(math.ceil(box[2 + k]), 0, limits[k])) for k in (0, 1))
    return left, top, right, bottom


def _label_sizes(person: _Person, font: Font) -> tuple[Size, ...]:
    """Return the sizes of a person's labels, the smallest first."""
    gap, sizes = _label_gap(font), []
    for rows in _texts(person):
        width = max(font.width_px(row) for row in rows) + 2 * gap
        height = len(rows) * font.height_px + gap
        sizes.append((width, height + _bar_height(person, rows, font)))
    return tuple(sizes)


def _label_gap(font: Font) -> int:
    return max(font.height_px // 4, 3)


def _bar_height(person: _Person, rows: Sequence[str], font: Font) -> int:
    """Return the height of the bar with its margin: a whole label with an α has one."""
    has_bar = len(rows) > 1 and person.observation.awareness is not None
    return 2 * _label_gap(font) if has_bar else 0


def _draw_label(image: ImageRgb, person: _Person, place: Place, font: Font) -> None:
    """Draw α, why there is none, or all: the distance and a bar as well."""
    left, top, right, bottom = place.box
    gap, rows = _label_gap(font), _texts(person)[place.size]
    darken_box(image, place.box)
    colour = awareness_colour(person.observation.awareness)
    _fill_box(image, (left, top, left + max(gap // 2, 2), bottom), colour)
    for number, row in enumerate(rows):
        corner = left + gap, top + gap // 2 + number * font.height_px
        font.write(image, row, corner, WHITE)
    if _bar_height(person, rows, font):
        bar = (left + gap, bottom - 2 * gap, right - gap, bottom - gap)
        _draw_bar(image, bar, person.observation, person.track)


def _draw_bar(
    image: ImageRgb, bar: Box, observation: PersonObservation, track: PersonTrack | None
) -> None:
    """Draw α, its standard deviation and the lower bound on a scale from 0 to 1."""
    left, top, right, bottom = bar
    span, height = right - left, bottom - top
    _fill_box(image, bar, (74, 78, 88))
    alpha, spread = observation.awareness, observation.awareness_std
    if alpha is not None and spread is not None:
        colour = awareness_colour(alpha)
        low, high = max(alpha - spread, 0.0), min(alpha + spread, 1.0)
        faint = tuple((np.array(colour) * 0.55 + 30.0).astype(int).tolist())
        _fill_box(image, (left, top, left + round(alpha * span), bottom), colour)
        band = (
            left + round(low * span),
            top + height // 3,
            left + max(round(high * span), round(low * span) + 1),
            bottom - height // 3,
        )
        _fill_box(image, band, (faint[0], faint[1], faint[2]))
    if track is not None:
        mark = left + round(track.awareness_lower * (span - 2))
        _fill_box(image, (mark, top - 2, mark + 2, bottom + 2), WHITE)


def _fill_box(image: ImageRgb, box: Box, colour: Colour) -> None:
    left, top, right, bottom = box
    image[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)] = colour


def _draw_caption(
    image: ImageRgb, estimate: FrameEstimate, font: Font, heads: Sequence[Box]
) -> Box:
    """Write stamp, number of people and unfit networks into a corner without heads; return it."""
    count = len(estimate.observations)
    people = "nobody" if not count else "1 person" if count == 1 else f"{count} people"
    text = f"{estimate.frame.stamp_s:.2f} s · {people}"
    if estimate.unfit:
        text += " · made for renders, do not trust"
    gap = font.height_px // 3
    width, height = font.width_px(text) + 3 * gap, font.height_px + gap
    right, bottom = image.shape[1] - width, image.shape[0] - height
    corners = [(0, bottom), (0, 0), (right, 0), (right, bottom)]
    boxes = [(left, top, left + width, top + height) for left, top in corners]
    free = (box for box in boxes if not any(meet(box, head) for head in heads))
    box = next(free, boxes[0])
    darken_box(image, box, 0.55)
    font.write(image, text, (box[0] + gap, box[1] + gap // 2), WHITE)
    return box


class OverlayWriter(AbstractContextManager["OverlayWriter"]):
    """Draws estimates into a video (``.mp4``), a folder of images, or one image file.

    A video has the size of its first image; images of another size are fitted into it. The video
    appears when it is closed; an interrupted one can be played too.

    Args:
        path: of the video, the folder (which is made) or, with ``single``, the image file.
        rate_hz: frames per second of a video.
        cone: the attention cone.
        single: whether there is only one image, which may go into an image file.

    Raises:
        AwarenavError: for a path that is none of these, or a video if PyAV is not installed.
    """

    def __init__(
        self, path: Path, rate_hz: float, cone: AttentionCone, *, single: bool = False
    ) -> None:
        self._path = path
        self._rate_hz = max(round(rate_hz), 1)
        self._cone = cone
        self._video: VideoWriter | None = None
        self._size_px = (0, 0)
        suffix = path.suffix.lower()
        self._is_video = suffix == ".mp4"
        self._is_file = self._is_video or (single and suffix in IMAGE_SUFFIXES)
        if suffix in _FILE_SUFFIXES and not self._is_file and not path.is_dir():
            single_file = " or, for one image, an image file" if single else ""
            raise AwarenavError(
                f"--overlay must be a .mp4 file, a folder{single_file} or 'none', got {path}"
            )
        if self._is_video:
            _video_writer()  # fails before the first estimate if PyAV is not installed
        folder = path.parent if self._is_file else path
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as cause:
            raise AwarenavError(
                f"cannot make the folder {folder}: {cause.strerror or cause}"
            ) from cause

    def add(self, estimate: FrameEstimate) -> None:
        """Draw an estimate and write the image."""
        image = draw_overlay(estimate, self._cone)
        if self._is_video:
            if self._video is None:
                # The sides of a yuv420p video are even.
                width, height = image.shape[1], image.shape[0]
                self._size_px = width + width % 2, height + height % 2
                self._video = _video_writer()(self._path, self._rate_hz, self._size_px)
            self._video.add(fit_image(image, *self._size_px))
        elif self._is_file:
            _write_image(self._path, image)
        else:
            _write_image(self._path / f"{Path(estimate.frame.name).stem}.png", image)

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Finish the video, if there is one."""
        if self._video is not None:
            self._video.close()


def _video_writer() -> type[VideoWriter]:
    try:
        from ..video import VideoWriter  # noqa: PLC0415 - PyAV is an optional dependency
    except ImportError as cause:
        raise MissingExtraError(
            "drawing into a video needs PyAV, which is not installed: pip install av; or draw into "
            "a folder (--overlay DIR)"
        ) from cause
    return VideoWriter


def _write_image(path: Path, image: ImageRgb) -> None:
    try:
        good, data = cv2.imencode(path.suffix, image[..., ::-1])
    except cv2.error as cause:
        raise AwarenavError(f"cannot write {path}: {cause}") from cause
    if not good:
        raise AwarenavError(f"cannot write {path}: it cannot be encoded")
    with atomic_path(path) as part:
        part.write_bytes(data.tobytes())


def fit_image(image: ImageRgb, width_px: int, height_px: int) -> ImageRgb:
    """Return an image of another size with this one in its middle, shrunk if it is too large."""
    height, width = image.shape[:2]
    if (width, height) == (width_px, height_px):
        return image
    scale = min(width_px / width, height_px / height, 1.0)
    if scale < 1.0:
        width, height = max(round(width * scale), 1), max(round(height * scale), 1)
        image = np.asarray(
            cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8
        )
    canvas = np.zeros((height_px, width_px, 3), np.uint8)
    top, left = (height_px - height) // 2, (width_px - width) // 2
    canvas[top : top + height, left : left + width] = image
    return canvas
