"""A pose estimator that runs MediaPipe's networks, which are trained on photographs.

It needs the extra ``awarenav[mediapipe]``, whose package contains the networks. MediaPipe Pose
finds one person in an image and gives 33 points, in the image and in metres from the mid-hip. Its
visibility scores stay near 1 on backs of heads, so they are no evidence that a face is seen.
MediaPipe Face Mesh is evidence: it returns a result only where it finds a face, and then its nose,
eyes and ears are more accurate.

Source: Bazarevsky et al., "BlazePose: On-device Real-time Body Pose tracking", 2020; Kartynnik et
al., "Real-time Facial Surface Geometry from Monocular Video on Mobile GPUs", 2019.
"""

from __future__ import annotations

import warnings
from abc import abstractmethod
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any, Final, TypeVar

import cv2
import numpy as np

from ... import layouts as kp
from ..._stages import PersonDetection, PersonKeypoints
from ...arrays import FloatArray, ImageRgb
from ...errors import PerceptionError
from ...installation import install_command
from .._images import rgb_image

#: Smallest confidence of a person in a box, and of a face in a square about a head.
CONFIDENCE: Final = 0.4

_E = TypeVar("_E", bound="MediaPipeEstimator")


class MediaPipeEstimator(AbstractContextManager[Any]):
    """Base of the estimators that own solutions of MediaPipe, and release them when closed.

    A class makes its solutions in ``_made``. An estimator serves one thread.

    Raises:
        PerceptionError: if MediaPipe is not installed; the message names the extra.
    """

    def __init__(self) -> None:
        face_mesh, pose = mediapipe_solutions(type(self).__name__)
        with without_protobuf_warnings():
            self._solutions = self._made(face_mesh, pose)

    @abstractmethod
    def _made(self, face_mesh: Any, pose: Any) -> tuple[Any, ...]:
        """Return the solutions, from MediaPipe's modules ``face_mesh`` and ``pose``."""

    def __enter__(self: _E) -> _E:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Release MediaPipe's memory; the estimator cannot be used afterwards."""
        solutions, self._solutions = self._solutions, ()
        for solution in solutions:
            solution.close()

    def _require_open(self) -> None:
        if not self._solutions:
            raise PerceptionError(f"the {type(self).__name__} has been closed")


def mediapipe_solutions(asker: str) -> tuple[Any, Any]:
    """Return MediaPipe's modules ``face_mesh`` and ``pose``, for the class ``asker``.

    Raises:
        PerceptionError: if MediaPipe is not installed; the message names the extra.
    """
    try:
        with without_protobuf_warnings():
            from mediapipe.python.solutions import face_mesh, pose  # noqa: PLC0415
    except ImportError as cause:
        raise PerceptionError(
            f"{asker} needs mediapipe 0.10.14, which cannot be imported ({cause}); "
            f"it is the extra 'mediapipe': {install_command('mediapipe')}"
        ) from cause
    return face_mesh, pose


@contextmanager
def without_protobuf_warnings() -> Iterator[None]:
    """Silence protobuf: MediaPipe 0.10.14 calls deprecated functions of it for each result."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"google\.protobuf\..*")
        warnings.filterwarnings("ignore", message=r"SymbolDatabase\.GetPrototype")
        yield


# MediaPipe's landmark of each COCO keypoint.
_LANDMARKS: Final = (0, 2, 5, 7, 8, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28)
# Mesh points whose mean is nose, left eye, right eye, left ear and right ear (its tragion).
_MESH: Final = ((1,), (263, 362), (33, 133), (454,), (234,))

# Paddings of a person's box; the second is tried when nobody is found with the first.
_PADDINGS: Final = (1.25, 1.5)
# Half the side of the head's square, in units of the body size from _body_size_px.
_HEAD_HALF_SIDE: Final = 0.9
# A smaller head crop is enlarged to this length of its longer side.
_HEAD_CROP_PX: Final = 256
_MIN_CROP_PX: Final = 8
# Angles off the camera between which an ear goes out of sight behind the cheek, and an eye behind
# the nose.
_EAR_HIDES_RAD: Final = (np.deg2rad(15.0), np.deg2rad(40.0))
_EYE_HIDES_RAD: Final = (np.deg2rad(50.0), np.deg2rad(80.0))


class MediaPipePoseEstimator(MediaPipeEstimator):
    """Keypoints of detected people by MediaPipe Pose, and of their faces by Face Mesh.

    Each person is processed alone, in the padded box, and each frame by itself: nothing is carried
    over between people or frames. All scores are 0 for a person whom MediaPipe does not find in
    the box. ``face_evidence`` of the result is True where Face Mesh found a face; nose, eyes and
    ears then come from the mesh.

    An estimator serves one thread. Close it, or use it in a ``with`` block, to release its memory.

    Raises:
        PerceptionError: if MediaPipe is not installed; the message names the extra.
    """

    def _made(self, face_mesh: Any, pose: Any) -> tuple[Any, ...]:
        # The package contains the network of complexity 1 only; others would be downloaded.
        self._pose = pose.Pose(
            static_image_mode=True, model_complexity=1, min_detection_confidence=CONFIDENCE
        )
        self._mesh = face_mesh.FaceMesh(
            static_image_mode=True, max_num_faces=1, min_detection_confidence=CONFIDENCE
        )
        return self._pose, self._mesh

    def estimate(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return one set of COCO keypoints per detection, in the same order.

        ``keypoints_root_m`` are in metres from the mid-hip, in the axes of a camera that looks
        straight at the person.

        Args:
            image_rgb: (H, W, 3) uint8.
            detections: the people.

        Raises:
            PerceptionError: for an image of another type or shape, and for a closed estimator.
        """
        image = rgb_image(image_rgb)
        self._require_open()
        with without_protobuf_warnings():
            return tuple(self._person(image, person.box_xyxy_px) for person in detections)

    def _person(self, image: ImageRgb, box_xyxy_px: FloatArray) -> PersonKeypoints:
        for padding in _PADDINGS:
            found = self._body(image, _padded_box(box_xyxy_px, padding))
            if found is not None and _is_in_box(found[0], box_xyxy_px):
                break
        else:
            return _unseen_person(box_xyxy_px)
        keypoints_px, root_m, scores = found
        face = self._face(image, keypoints_px)
        if face is not None:
            keypoints_px[kp.HEAD], scores[kp.HEAD] = face
        return PersonKeypoints(keypoints_px, root_m, scores, "coco", face_evidence=face is not None)

    def _body(
        self, image: ImageRgb, box_xyxy_px: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Return keypoints (17, 2), metres (17, 3) and scores (17,) of the person in a box."""
        crop, corner = _cropped(image, box_xyxy_px)
        if crop is None:
            return None
        result = self._pose.process(crop)
        if result.pose_landmarks is None or result.pose_world_landmarks is None:
            return None
        marks = [result.pose_landmarks.landmark[row] for row in _LANDMARKS]
        world = [result.pose_world_landmarks.landmark[row] for row in _LANDMARKS]
        keypoints = _in_image(np.array([(mark.x, mark.y) for mark in marks]), crop, corner)
        root = np.array([(mark.x, mark.y, mark.z) for mark in world])
        scores = np.clip([mark.visibility for mark in marks], 0.0, 1.0)
        if not (np.isfinite(keypoints).all() and np.isfinite(root).all()):
            return None
        return keypoints, root, np.nan_to_num(scores, nan=0.0)

    def _face(
        self, image: ImageRgb, keypoints_px: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return keypoints (5, 2) and scores (5,) of the face; None if no face is found."""
        size_px = _body_size_px(keypoints_px)
        centre = keypoints_px[kp.HEAD].mean(axis=0)
        half = _HEAD_HALF_SIDE * size_px
        crop, corner = _cropped(image, np.concatenate([centre - half, centre + half]) + 0.5)
        if crop is None:
            return None
        enlarged = _enlarged(crop)
        faces = self._mesh.process(enlarged).multi_face_landmarks
        if not faces:
            return None
        marks = faces[0].landmark
        # z is in the same unit as x.
        points = np.array([_mean_landmark(marks, rows, enlarged) for rows in _MESH])
        if not np.isfinite(points).all():
            return None
        share = points[:, :2] / [enlarged.shape[1], enlarged.shape[0]]
        found = _in_image(share, crop, corner)
        if float(np.linalg.norm(found.mean(axis=0) - centre)) > half:
            return None  # the face of a neighbour
        return found, _face_scores(points)


def _padded_box(box_xyxy_px: FloatArray, padding: float) -> FloatArray:
    centre = 0.5 * (box_xyxy_px[:2] + box_xyxy_px[2:])
    half = 0.5 * padding * (box_xyxy_px[2:] - box_xyxy_px[:2])
    return np.concatenate([centre - half, centre + half])


def _cropped(image: ImageRgb, box_xyxy_px: FloatArray) -> tuple[ImageRgb | None, FloatArray]:
    """Return the part of the image in a box and its first pixel (x, y); None if it is too small."""
    limits = np.array([image.shape[1], image.shape[0]])
    low = np.clip(np.rint(box_xyxy_px[:2]), 0, limits).astype(int)
    high = np.clip(np.rint(box_xyxy_px[2:]), 0, limits).astype(int)
    if (high - low).min() < _MIN_CROP_PX:
        return None, low.astype(float)
    return np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]]), low.astype(float)


def _enlarged(crop: ImageRgb) -> ImageRgb:
    factor = _HEAD_CROP_PX / max(crop.shape[:2])
    if factor <= 1.0:
        return crop
    larger = cv2.resize(crop, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
    return np.asarray(larger, dtype=np.uint8)


def _in_image(share: FloatArray, crop: ImageRgb, corner: FloatArray) -> FloatArray:
    """Map points given as shares of a crop's sides to the image (pixel centres whole numbers)."""
    size = np.array([crop.shape[1], crop.shape[0]], dtype=float)
    return np.asarray(share * size + corner - 0.5)


def _mean_landmark(marks: Any, rows: tuple[int, ...], crop: ImageRgb) -> FloatArray:
    height, width = crop.shape[:2]
    points = [(marks[row].x * width, marks[row].y * height, marks[row].z * width) for row in rows]
    return np.asarray(np.mean(points, axis=0))


def _body_size_px(keypoints_px: FloatArray) -> float:
    """Return about the shoulder width in pixels, also for a person seen from the side."""
    left, right = keypoints_px[kp.LEFT_SHOULDER], keypoints_px[kp.RIGHT_SHOULDER]
    hips = keypoints_px[[kp.LEFT_HIP, kp.RIGHT_HIP]].mean(axis=0)
    torso = float(np.linalg.norm(0.5 * (left + right) - hips))
    return max(float(np.linalg.norm(left - right)), 0.7 * torso)


def _is_in_box(keypoints_px: FloatArray, box_xyxy_px: FloatArray) -> bool:
    """Return True if the midpoint of the person's shoulders lies in the box."""
    middle = 0.5 * (keypoints_px[kp.LEFT_SHOULDER] + keypoints_px[kp.RIGHT_SHOULDER]) + 0.5
    return bool(np.all(middle >= box_xyxy_px[:2]) and np.all(middle <= box_xyxy_px[2:]))


def _face_scores(points: FloatArray) -> FloatArray:
    """Return scores (5,) of the points (5, 3) of a face; those on the far side are lower.

    Points have axes x right, y down, z away from the camera.
    """
    across = points[kp.LEFT_EAR] - points[kp.RIGHT_EAR]
    # Positive yaw turns the nose to the image's left and the person's right side out of sight.
    yaw_rad = float(np.arctan2(-across[2], across[0]))
    turned = np.array([-yaw_rad, yaw_rad])  # left and right side, away from the camera
    eyes = 1.0 - np.interp(turned, _EYE_HIDES_RAD, (0.0, 1.0))
    ears = 1.0 - np.interp(turned, _EAR_HIDES_RAD, (0.0, 1.0))
    return np.array([1.0, *eyes, *ears])


def _unseen_person(box_xyxy_px: FloatArray) -> PersonKeypoints:
    count = len(_LANDMARKS)
    middle = 0.5 * (box_xyxy_px[:2] + box_xyxy_px[2:]) - 0.5
    return PersonKeypoints(
        np.tile(middle, (count, 1)),
        np.zeros((count, 3)),
        np.zeros(count),
        "coco",
        face_evidence=False,
    )
