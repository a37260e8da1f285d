"""MediaPipe as a pose estimator: genuine networks for a real camera that come in their package.

Needs the extra ``awarenav[mediapipe]``. MediaPipe Pose finds one person in a picture and says of
33 points where they are, in the picture and in metres from the middle of the hips. Its visibility
stays near 1 on backs of heads, so it is no evidence that a face is seen. MediaPipe Face Mesh is:
it answers only where it finds a face, and then places nose, eyes and ears better.

Source: Bazarevsky et al., "BlazePose: On-device Real-time Body Pose tracking", 2020; Kartynnik et
al., "Real-time Facial Surface Geometry from Monocular Video on Mobile GPUs", 2019.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from .. import layouts as kp
from .._detection import PersonDetection
from .._keypoints import PersonKeypoints
from ..arrays import FloatArray, ImageRgb, finite_number
from ..errors import PerceptionError
from ._image import rgb_image

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self  # in typing from Python 3.11 on

#: MediaPipe's landmark of each COCO keypoint.
_LANDMARKS: Final = (0, 2, 5, 7, 8, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28)
#: Mesh points whose mean is nose, left eye, right eye, left ear and right ear (its tragion).
_MESH: Final = ((1,), (263, 362), (33, 133), (454,), (234,))
_HEAD: Final = slice(0, 5)

# A person's picture: the box, padded; once more with more room when nobody is found in it.
_PADDINGS: Final = (1.25, 1.5)
# The head's picture, in units of the body's size below; its short faces are enlarged.
_HEAD_HALF_SIDE: Final = 0.9
_HEAD_PICTURE_PX: Final = 256
_SMALLEST_PX: Final = 8
# An ear disappears behind the cheek and an eye behind the nose as the head turns from the camera.
_EAR_HIDES_RAD: Final = (np.deg2rad(15.0), np.deg2rad(40.0))
_EYE_HIDES_RAD: Final = (np.deg2rad(50.0), np.deg2rad(80.0))


class MediaPipePoseEstimator:
    """Keypoints of detected people by MediaPipe Pose and, of their faces, by Face Mesh.

    Every person is looked at alone, in the padded box, and every frame by itself: nothing is
    carried over between people or frames. A person whom MediaPipe does not find in the box, or
    finds beside it, has scores of 0 throughout. ``face_evidence`` of the result is True where Face
    Mesh found a face; nose, eyes and ears are then the mesh's.

    One object serves one thread. Close it, or use it in a ``with`` block, to give its memory back.

    Args:
        min_detection_confidence: of a person in the box and of a face in the head's square, [0, 1].

    Raises:
        PerceptionError: MediaPipe is not installed (the message names the extra), or a value is
            not valid.
    """

    def __init__(self, min_detection_confidence: float = 0.4) -> None:
        confidence = finite_number(
            "min_detection_confidence", min_detection_confidence, minimum=0.0, maximum=1.0
        )
        pose, face_mesh = _solutions()
        with _quiet():
            # Complexity 1 is the only one whose network is in the package; others are downloaded.
            self._pose = pose.Pose(
                static_image_mode=True,
                model_complexity=1,
                min_detection_confidence=confidence,
            )
            self._mesh = face_mesh.FaceMesh(
                static_image_mode=True,
                max_num_faces=1,
                min_detection_confidence=confidence,
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give back what MediaPipe holds; the object cannot be used afterwards."""
        for solution in (self._pose, self._mesh):
            if solution is not None:
                solution.close()
        self._pose = self._mesh = None

    def estimate(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return one set of COCO keypoints a detection, in the same order.

        ``keypoints_root_m`` are metres from the middle of the hips in camera axes, as if the camera
        looked straight at the person.

        Args:
            image_rgb: (H, W, 3) uint8.
            detections: the people.

        Raises:
            PerceptionError: for an image of another kind, or a closed estimator.
        """
        image = rgb_image(image_rgb)
        if self._pose is None:
            raise PerceptionError("the MediaPipePoseEstimator has been closed")
        with _quiet():
            return tuple(self._person(image, seen.box_xyxy_px) for seen in detections)

    def _person(self, image: ImageRgb, box_xyxy_px: FloatArray) -> PersonKeypoints:
        for padding in _PADDINGS:
            found = self._body(image, _padded(box_xyxy_px, padding))
            if found is not None and _belongs(found[0], box_xyxy_px):
                break
        else:
            return _unseen(box_xyxy_px)
        keypoints_px, root_m, scores = found
        face = self._face(image, keypoints_px)
        if face is not None:
            keypoints_px[_HEAD], scores[_HEAD] = face
        return PersonKeypoints(keypoints_px, root_m, scores, "coco", face_evidence=face is not None)

    def _body(
        self, image: ImageRgb, square: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Keypoints (17, 2), metres (17, 3) and scores (17,) of who is in a part of the picture."""
        picture, corner = _part(image, square)
        if picture is None:
            return None
        result = self._pose.process(picture)
        if result.pose_landmarks is None or result.pose_world_landmarks is None:
            return None
        marks = [result.pose_landmarks.landmark[row] for row in _LANDMARKS]
        world = [result.pose_world_landmarks.landmark[row] for row in _LANDMARKS]
        keypoints = _in_image(np.array([(mark.x, mark.y) for mark in marks]), picture, corner)
        root = np.array([(mark.x, mark.y, mark.z) for mark in world])
        scores = np.clip([mark.visibility for mark in marks], 0.0, 1.0)
        if not (np.isfinite(keypoints).all() and np.isfinite(root).all()):
            return None
        return keypoints, root, np.nan_to_num(scores, nan=0.0)

    def _face(
        self, image: ImageRgb, keypoints_px: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """Keypoints (5, 2) and scores (5,) of the face, where one is found."""
        size_px = _body_size_px(keypoints_px)
        centre = keypoints_px[_HEAD].mean(axis=0)
        half = _HEAD_HALF_SIDE * size_px
        picture, corner = _part(image, np.concatenate([centre - half, centre + half]) + 0.5)
        if picture is None:
            return None
        enlarged = _enlarged(picture)
        faces = self._mesh.process(enlarged).multi_face_landmarks
        if not faces:
            return None
        marks = faces[0].landmark
        # z counts in the same unit as x.
        points = np.array([_mean_mark(marks, rows, enlarged) for rows in _MESH])
        if not np.isfinite(points).all():
            return None
        share = points[:, :2] / [enlarged.shape[1], enlarged.shape[0]]
        found = _in_image(share, picture, corner)
        if float(np.linalg.norm(found.mean(axis=0) - centre)) > half:
            return None  # a neighbour's
        return found, _face_scores(points)


def _solutions() -> tuple[Any, Any]:
    try:
        with _quiet():
            from mediapipe.python.solutions import face_mesh, pose  # noqa: PLC0415
    except ImportError as cause:
        raise PerceptionError(
            f"MediaPipePoseEstimator needs mediapipe 0.10.14, which cannot be imported ({cause}); "
            "it is the extra 'mediapipe': pip install 'awarenav[mediapipe]'"
        ) from cause
    return pose, face_mesh


@contextmanager
def _quiet() -> Iterator[None]:
    # MediaPipe 0.10.14 calls what its protobuf deprecates, for every result.
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"google\.protobuf\..*")
        warnings.filterwarnings("ignore", message=r"SymbolDatabase\.GetPrototype")
        yield


def _padded(box_xyxy_px: FloatArray, padding: float) -> FloatArray:
    centre = 0.5 * (box_xyxy_px[:2] + box_xyxy_px[2:])
    half = 0.5 * padding * (box_xyxy_px[2:] - box_xyxy_px[:2])
    return np.concatenate([centre - half, centre + half])


def _part(image: ImageRgb, box_xyxy_px: FloatArray) -> tuple[ImageRgb | None, FloatArray]:
    """The picture inside a box, which counts pixels from the corner, and its first pixel (x, y)."""
    limits = np.array([image.shape[1], image.shape[0]])
    low = np.clip(np.rint(box_xyxy_px[:2]), 0, limits).astype(int)
    high = np.clip(np.rint(box_xyxy_px[2:]), 0, limits).astype(int)
    if (high - low).min() < _SMALLEST_PX:
        return None, low.astype(float)
    return np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]]), low.astype(float)


def _enlarged(picture: ImageRgb) -> ImageRgb:
    factor = _HEAD_PICTURE_PX / max(picture.shape[:2])
    if factor <= 1.0:
        return picture
    larger = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
    return np.asarray(larger, dtype=np.uint8)


def _in_image(share: FloatArray, picture: ImageRgb, corner: FloatArray) -> FloatArray:
    """Shares of a part's sides as pixels of the image, whose centres are whole numbers."""
    size = np.array([picture.shape[1], picture.shape[0]], dtype=float)
    return np.asarray(share * size + corner - 0.5)


def _mean_mark(marks: Any, rows: tuple[int, ...], picture: ImageRgb) -> FloatArray:
    height, width = picture.shape[:2]
    points = [(marks[row].x * width, marks[row].y * height, marks[row].z * width) for row in rows]
    return np.asarray(np.mean(points, axis=0))


def _body_size_px(keypoints_px: FloatArray) -> float:
    """About the width of the shoulders, also of a person who is seen from the side."""
    left, right = keypoints_px[kp.LEFT_SHOULDER], keypoints_px[kp.RIGHT_SHOULDER]
    hips = keypoints_px[[kp.LEFT_HIP, kp.RIGHT_HIP]].mean(axis=0)
    torso = float(np.linalg.norm(0.5 * (left + right) - hips))
    return max(float(np.linalg.norm(left - right)), 0.7 * torso)


def _belongs(keypoints_px: FloatArray, box_xyxy_px: FloatArray) -> bool:
    """Whether the person found is the one of the box: the middle of the shoulders lies in it."""
    middle = 0.5 * (keypoints_px[kp.LEFT_SHOULDER] + keypoints_px[kp.RIGHT_SHOULDER]) + 0.5
    return bool(np.all(middle >= box_xyxy_px[:2]) and np.all(middle <= box_xyxy_px[2:]))


def _face_scores(points: FloatArray) -> FloatArray:
    """Scores (5,) of a face's points (5, 3), in x right, y down, z away: the far side fades."""
    across = points[kp.LEFT_EAR] - points[kp.RIGHT_EAR]
    # Positive turns the nose to the image's left, which takes the person's right side out of sight.
    yaw_rad = float(np.arctan2(-across[2], across[0]))
    turned = np.array([-yaw_rad, yaw_rad])  # of left and right, away from the camera
    eyes = 1.0 - np.interp(turned, _EYE_HIDES_RAD, (0.0, 1.0))
    ears = 1.0 - np.interp(turned, _EAR_HIDES_RAD, (0.0, 1.0))
    return np.array([1.0, *eyes, *ears])


def _unseen(box_xyxy_px: FloatArray) -> PersonKeypoints:
    count = len(_LANDMARKS)
    middle = 0.5 * (box_xyxy_px[:2] + box_xyxy_px[2:]) - 0.5
    return PersonKeypoints(
        np.tile(middle, (count, 1)),
        np.zeros((count, 3)),
        np.zeros(count),
        "coco",
        face_evidence=False,
    )
