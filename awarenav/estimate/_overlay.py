"""Draws estimates into their images, and these into a video, a folder or a file."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
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
from ..errors import AwarenavError, MissingExtraError
from ..files import atomic_path
from ._estimator import FrameEstimate
from ._labels import HEAD, SEEN_SCORE, Person, draw_labels
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
# Lines and letters are made for a picture of this size, and grow with larger ones.
_UNIT_PX2: Final = 640.0 * 480.0
# Lengths of the cone and of the arrow along its axis.
_CONE_LENGTH_M: Final = 0.14
_ARROW_LENGTH_M: Final = 0.34
_RIM_ANGLES: Final = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)[:, None]


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
    unit = max(math.sqrt(image.shape[0] * image.shape[1] / _UNIT_PX2), 0.5)
    tracks = {track.id: track for track in estimate.tracks or ()}
    people = [
        Person(observation, keypoints, None if track_id is None else tracks.get(track_id))
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
    caption = f"{estimate.frame.stamp_s:.2f} s · {_counted(len(people))}"
    if estimate.unfit:
        caption += " · made for renders, do not trust"
    draw_labels(image, people[::-1], estimate.camera, Font(round(18 * unit)), caption)
    return image


def _draw_gaze(
    image: ImageRgb, camera: Camera, person: Person, cone: AttentionCone, unit: float
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


def _head_position(camera: Camera, person: Person) -> FloatArray | None:
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


def _counted(people: int) -> str:
    return "nobody" if not people else "1 person" if people == 1 else f"{people} people"


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
