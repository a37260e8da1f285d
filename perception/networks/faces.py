"""Faces of near people by MediaPipe's face networks: keypoints, evidence of a face, and eyes.

Pose networks say little of a small head: their keypoints of a face lie a few pixels apart, and the
scores of some stay high on backs of heads. Here a detector of faces looks into a square about the
head, and a mesh of the face that it found tells whether it is one. Both are trained on photographs.

Contract of ``face_landmarker.task``: a ZIP with two TFLite files. ``face_detector.tflite``
(BlazeFace, short range): input (1, 128, 128, 3) float32 RGB in [-1, 1]; for each of 896 anchors 16
offsets in pixels (centre, size, six points: right eye, left eye, …) and the logit of a face.
``face_landmarks_detector.tflite`` (attention mesh): input (1, 256, 256, 3) float32 RGB in [0, 1], a
square 1.5 times as large as the face and upright with it; 478 points x, y, z in pixels of the
input, five of each iris among them, and the logit of a face.

Source: Bazarevsky et al., "BlazeFace: Sub-millisecond Neural Face Detection on Mobile GPUs", 2019;
Kartynnik et al., "Real-time Facial Surface Geometry from Monocular Video on Mobile GPUs", 2019;
Grishchenko et al., "Attention Mesh: High-fidelity Face Mesh Prediction in Real-time", 2020;
MediaPipe, ``mediapipe/modules/face_detection`` and ``face_landmark``.
"""

from __future__ import annotations

import io
import math
import os
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from .. import layouts as kp
from .._camera import Camera
from .._stages import HeadPose, PersonDetection, PersonKeypoints, PoseEstimator
from ..anthropometry import EYES_HEAD_M, HEAD_CENTRE_HEAD_M
from ..arrays import FloatArray, ImageRgb
from ..body import DEFAULT_MIN_SCORE
from ..errors import PerceptionError
from ..eyes import EyeGaze, eyes_from_irises
from ._images import rgb_image
from ._model import read_as
from ._settings import OnnxSettings
from ._tflite import TfliteModel
from .heads import head_crop, looking_at, ray_focal_px
from .small_faces import RetinaFace

_DETECTOR: Final = "face_detector.tflite"
_MESH: Final = "face_landmarks_detector.tflite"
_DETECTOR_PX: Final = 128
_MESH_PX: Final = 256
# Extents of the outputs that are read.
_ANCHORS: Final = 896
_OFFSETS: Final = 16
_LANDMARKS: Final = 478
# (896, 2) centres of the anchors as shares of the side: two at a place of 16 × 16, six of 8 × 8.
_CENTRES: Final = np.concatenate(
    [
        np.repeat((np.mgrid[:count, :count].reshape(2, -1).T[:, ::-1] + 0.5) / count, times, axis=0)
        for count, times in ((16, 2), (8, 6))
    ]
)
# Detections whose centres are so close (share of the side) and whose probabilities are so near the
# best are averaged, weighted with them, as in MediaPipe's non-maximum suppression.
_SAME_FACE: Final = 0.1
_AVERAGED: Final = 0.5
#: Smallest probability of a face, of the detector and of the mesh. On labelled photographs of
#: people seen from 2 to 10 m, no back and no profile passes both.
DETECTED: Final = 0.6
CONFIRMED: Final = 0.8
# The square for the mesh, in larger sides of the detected face.
_MESH_SIDES: Final = 1.5
# The square for the detector, in units of the body size from _body_size_px, and how far from its
# middle a face may lie, in the same unit.
_HEAD_SIDES: Final = 2.0
_FARTHEST: Final = 0.4
_MIN_SIDE_PX: Final = 8.0
# The mesh may lay a face that looks here over a profile. Then its nose lies elsewhere, from the
# middle of the ears, than that of the pose network: by 0.4 to 1.5 sizes of the face on renders that
# are turned by 70 to 100°, and up to 0.36 of faces that look here. It may also lie beside the nose
# and eyes of the pose network: on photographs by 0.5 sizes over profiles that seem to look here,
# and up to 0.2 over faces. The size is the distance of the ears, or so many times that of eyes and
# nose.
_NOSE_APART: Final = 0.4
_FACE_APART: Final = 0.35
_NOSE_SIZES: Final = 3.3
# A small face looks here if its nose lies between its eyes, at this share of the way. It is that of
# the head if its nose and eyes lie where the pose network has them, by this share of the body size:
# a neighbour's and one on a poster lie elsewhere. It counts over shoulders that are seen and that
# face the camera, too, by at least this width in the same unit (60°): on photographs they are 0.56
# to 1.0 of those who look here, and a face beside a turned body is often taken for its head.
_BETWEEN: Final = (0.25, 0.75)
_APART: Final = 0.15
_OPEN: Final = 0.5
# Mesh points whose mean is nose, left eye, right eye, left ear and right ear, and their places in
# the head frame. Beside COCO's points the tip of the nose is lower and farther ahead, and the ears
# are the edge of the cheeks: with COCO's places, heads seemed lowered by 0.6 of what they were.
# Fitted to 131 faces of thirteen rendered workers that are turned by up to 45°. On 20 faces of
# photographs the median distance from the mesh's own depths is 3 mm (COCO's places: 12 mm).
_HEAD_POINTS: Final = ((1, 1), (263, 362), (33, 133), (454, 323), (234, 93))
_HEAD_POINTS_M: Final = np.array(
    [
        [0.009, 0.013, 0.000],
        [-0.029, -0.020, -0.030],
        [-0.029, -0.020, 0.030],
        [-0.007, -0.072, -0.068],
        [-0.007, -0.072, 0.068],
    ]
)
# Angles off the camera between which an ear goes out of sight behind the cheek, and an eye behind
# the nose.
_EAR_HIDES_RAD: Final = (math.radians(15.0), math.radians(40.0))
_EYE_HIDES_RAD: Final = (math.radians(50.0), math.radians(80.0))


class FaceMesh:
    """A face in a square about a head; the contract is in the module's text.

    Args:
        path: the ``.task`` file, or its bytes.
        settings: threads.
        sha256: expected SHA-256 of the file, 64 hexadecimal digits; None takes any.

    Raises:
        PerceptionError: for a file that cannot be read, and for other networks in it.
    """

    def __init__(
        self,
        path: str | os.PathLike[str] | bytes,
        *,
        settings: OnnxSettings | None = None,
        sha256: str | None = None,
    ) -> None:
        what = f"MediaPipe's face_landmarker.task, a ZIP with {_DETECTOR} and {_MESH}"
        name, files = read_as(what, _members, path, sha256)
        self._detector, self._mesh = (TfliteModel(each, settings=settings) for each in files)
        self._detector_ends = _named(self._detector, name, (_ANCHORS * _OFFSETS, _ANCHORS))
        # Of the mesh's two outputs of one number the first is the face's.
        self._mesh_ends = _named(self._mesh, name, (_LANDMARKS * 3, 1))

    def find(
        self, image_rgb: ImageRgb, centre_px: FloatArray, side_px: float, farthest_px: float
    ) -> FloatArray | None:
        """Return the points (478, 3) of the face in a square; None without a face.

        The points are u, v and depth from the middle of the head, all in pixels of the image.

        Args:
            image_rgb: (H, W, 3) uint8.
            centre_px: (2,) middle of the square.
            side_px: its side.
            farthest_px: a face that lies farther from the middle is another's.
        """
        if not (side_px >= _MIN_SIDE_PX and np.isfinite(centre_px).all()):
            return None
        found = self._detected(image_rgb, centre_px, side_px)
        if found is None:
            return None
        middle, size_px, right_eye, left_eye = found
        if float(np.linalg.norm(middle - centre_px)) > farthest_px:
            return None
        across = left_eye - right_eye
        roll_rad = math.atan2(across[1], across[0])
        crop, to_image = _square(image_rgb, middle, _MESH_SIDES * size_px, roll_rad, _MESH_PX)
        outputs = self._mesh.run(crop[None] / np.float32(255.0))
        points, logit = (outputs[end].ravel() for end in self._mesh_ends)
        if not (expit(logit[0]) >= CONFIRMED and np.isfinite(points).all()):
            return None
        marks = points.reshape(_LANDMARKS, 3).astype(np.float64)
        # The network counts from the corner, image points from the middle of the first pixel.
        in_image = (marks[:, :2] - 0.5) @ to_image[:, :2].T + to_image[:, 2]
        scale = float(np.linalg.norm(to_image[:, 0]))
        return np.column_stack([in_image, scale * marks[:, 2]])

    def _detected(
        self, image: ImageRgb, centre_px: FloatArray, side_px: float
    ) -> tuple[FloatArray, float, FloatArray, FloatArray] | None:
        """Return middle (2,), larger side, right and left eye (2,) of the best face in a square."""
        crop, to_image = _square(image, centre_px, side_px, 0.0, _DETECTOR_PX)
        outputs = self._detector.run(crop[None] / np.float32(127.5) - np.float32(1.0))
        offsets, logits = (outputs[end][0] for end in self._detector_ends)
        probabilities = expit(logits.ravel().astype(np.float64))
        best = int(probabilities.argmax())
        if not probabilities[best] >= DETECTED:
            return None
        shares = offsets.astype(np.float64) / _DETECTOR_PX
        middles = _CENTRES + shares[:, :2]
        close = np.abs(middles - middles[best]).max(axis=1) < _SAME_FACE
        rows = np.flatnonzero(close & (probabilities > _AVERAGED * probabilities[best]))
        weights = probabilities[rows] / probabilities[rows].sum()
        points = (_CENTRES[rows, None] + shares[rows].reshape(len(rows), 8, 2)).transpose(1, 0, 2)
        middle, _, right_eye, left_eye = (
            to_image[:, :2] @ (weights @ point * _DETECTOR_PX - 0.5) + to_image[:, 2]
            for point in points[:4]
        )
        size = weights @ shares[rows, 2:4]
        if not (np.isfinite(middle).all() and size.max() > 0.0):
            return None
        return middle, float(size.max()) * side_px, right_eye, left_eye


class FaceMeshPoseEstimator:
    """A pose estimator whose people get the faces of :class:`FaceMesh`.

    ``face_evidence`` of a person is True where a face was found; nose, eyes and ears then come from
    it. It is False where none was found, or one that is turned elsewhere than the head. Where the
    mesh finds none, a small face that looks here is evidence alone: the keypoints stay.

    Args:
        pose_estimator: finds the bodies.
        mesh: finds the faces.
        small_faces: looks again where the mesh finds none; None for nothing.
    """

    def __init__(
        self,
        pose_estimator: PoseEstimator,
        mesh: FaceMesh,
        small_faces: RetinaFace | None = None,
    ) -> None:
        self._pose_estimator, self._mesh = pose_estimator, mesh
        self._small_faces = small_faces

    def estimate(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return one set of keypoints per detection, in the same order.

        Raises:
            PerceptionError: as the pose estimator, and when a network of faces fails.
        """
        image = rgb_image(image_rgb)
        people = self._pose_estimator.estimate(image, detections)
        return tuple(self._with_face(image, person) for person in people)

    def _with_face(self, image: ImageRgb, person: PersonKeypoints) -> PersonKeypoints:
        if not person.scores[kp.HEAD].any():
            return replace(person, face_evidence=False)
        pixels, scores = person.keypoints_px.copy(), person.scores.copy()
        size_px = _body_size_px(pixels)
        centre = pixels[kp.HEAD].mean(axis=0)
        marks = self._mesh.find(image, centre, _HEAD_SIDES * size_px, _FARTHEST * size_px)
        if marks is None:
            small = self._is_small_face(image, person, centre, size_px)
            return replace(person, face_evidence=small)
        points = np.array([marks[list(rows)].mean(axis=0) for rows in _HEAD_POINTS])
        if not _agree(pixels[kp.HEAD], points[:, :2]):
            return replace(person, face_evidence=False)
        eyes_open = bool(_openings(marks[:, :2]).mean() > _MIN_OPENING)
        pixels[kp.HEAD], scores[kp.HEAD] = points[:, :2], _face_scores(points)
        return replace(
            person,
            keypoints_px=pixels,
            scores=scores,
            face_evidence=True,
            face_points_m=_HEAD_POINTS_M,
            eyes_open=eyes_open,
            irises_px=iris_offset(marks[:, :2]),
        )

    def _is_small_face(
        self, image: ImageRgb, person: PersonKeypoints, centre_px: FloatArray, size_px: float
    ) -> bool:
        """Return whether the head of the pose network looks here with a face of its own."""
        if self._small_faces is None or person.scores[kp.SHOULDERS].min() < DEFAULT_MIN_SCORE:
            return False
        face = self._small_faces.find(image, centre_px, _HEAD_SIDES * size_px, _FARTHEST * size_px)
        if face is None:
            return False
        right_eye, left_eye, nose = face[:3]
        across = left_eye - right_eye
        share = float((nose - right_eye) @ across) / max(float(across @ across), 1e-9)
        shoulders_px = np.subtract(*person.keypoints_px[kp.SHOULDERS])
        open_to = float(shoulders_px @ across) >= _OPEN * size_px * float(np.linalg.norm(across))
        apart_px = np.stack([nose, left_eye, right_eye]) - person.keypoints_px[:3]
        own = float(np.linalg.norm(apart_px, axis=1).max()) <= _APART * size_px
        return own and open_to and _BETWEEN[0] <= share <= _BETWEEN[1]


# Landmarks of the left and of the right eye: iris, corners, upper and lower lid.
_IRISES: Final = (473, 468)
_CORNERS: Final = ((362, 263), (133, 33))
_LIDS: Final = ((386, 374), (159, 145))
_MIN_DEPTH_M: Final = 0.1
# Smaller irises (diameter) show no direction.
_IRIS_M: Final = 0.0117
_MIN_IRIS_PX: Final = 2.5
# Farther from the camera, the far eye hides behind the nose and the mesh slips.
_MAX_HEAD_ANGLE_RAD: Final = math.radians(50.0)
# Lids that are closer together than this share of the eye's width are closed, or cover the iris of
# an eye that looks down: on photographs 0.07 to 0.11 of people who look down, from 0.19 of others.
_MIN_OPENING: Final = 0.15
# Error of the mean place of both irises between the corners: in pixels of the image, and in metres
# however many pixels there are; across the head and along its height, where lids cover the irises.
_IRIS_STD_PX: Final = 0.25
_IRIS_STD_M: Final = (4e-4, 1.5e-3)


class FaceMeshEyeEstimator:
    """Rotation of the eyes of near people, from the irises of :class:`FaceMeshPoseEstimator`.

    There is no result for an iris of less than 2.5 pixels across (2.6 m at 640 pixels and 60°) or a
    head that is turned more than 50° away from the camera; and none where no face is found or the
    eyes are closed.
    """

    def estimate(
        self,
        image_rgb: ImageRgb,
        camera: Camera,
        heads: tuple[HeadPose | None, ...],
        people: tuple[PersonKeypoints, ...],
    ) -> tuple[EyeGaze | None, ...]:
        """Return the rotation of each person's eyes in the head; None where it is not known.

        Args:
            image_rgb: not used; may be None.
            camera: camera of the image.
            heads: head pose of each person.
            people: the persons, with their irises.
        """
        return tuple(
            None
            if head is None or person.irises_px is None
            else _eyes(camera, head, person.irises_px)
            for head, person in zip(heads, people, strict=True)
        )


def _eyes(camera: Camera, head: HeadPose, irises_px: FloatArray) -> EyeGaze | None:
    centre_m, eyes_m = (
        head.position_camera_m + head.rotation_camera_head @ place
        for place in (HEAD_CENTRE_HEAD_M, EYES_HEAD_M)
    )
    if centre_m[2] < _MIN_DEPTH_M or head.off_camera_rad > _MAX_HEAD_ANGLE_RAD:
        return None
    px_per_m = ray_focal_px(camera) / float(np.linalg.norm(eyes_m))
    centre_px = camera.project(centre_m[None])
    if px_per_m * _IRIS_M < _MIN_IRIS_PX or not np.isfinite(centre_px).all():
        return None
    axes, stretch = looking_at(camera, centre_px)
    offset_px = np.linalg.inv(stretch[0]) @ irises_px
    return eyes_from_irises(offset_px / px_per_m, axes[0], head, iris_std_m=iris_std_m(px_per_m))


def iris_std_m(px_per_m: float) -> tuple[float, float]:
    """Return standard deviations of the mean offset of both irises, across and along the head."""
    across, along = _IRIS_STD_M
    pixels_m = _IRIS_STD_PX / px_per_m
    return math.hypot(pixels_m, across), math.hypot(pixels_m, along)


def iris_offset(points: FloatArray) -> FloatArray | None:
    """Return (2,) the mean offset of both irises from the midpoints of the corners of their eyes.

    None for closed eyes.

    Args:
        points: (478, 2) landmarks of the mesh.
    """
    if not (_openings(points) > _MIN_OPENING).all():
        return None
    return np.asarray((points[list(_IRISES)] - points[[*_CORNERS]].mean(axis=1)).mean(axis=0))


def _openings(points: FloatArray) -> FloatArray:
    """Return (2,) distances of the lids of both eyes as shares of the eyes' widths."""
    corners, lids = points[[*_CORNERS]], points[[*_LIDS]]
    width = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1)
    opening = np.linalg.norm(lids[:, 0] - lids[:, 1], axis=1)
    return np.asarray(opening / np.maximum(width, 1e-9))


def _body_size_px(keypoints_px: FloatArray) -> float:
    """Return about the shoulder width in pixels, also for a person seen from the side."""
    left, right = keypoints_px[kp.LEFT_SHOULDER], keypoints_px[kp.RIGHT_SHOULDER]
    hips = keypoints_px[kp.HIPS].mean(axis=0)
    torso = float(np.linalg.norm(0.5 * (left + right) - hips))
    return max(float(np.linalg.norm(left - right)), 0.7 * torso)


def _face_scores(points: FloatArray) -> FloatArray:
    """Return scores (5,) of the points (5, 3) of a face; those on the far side are lower.

    Points have axes x right, y down, z away from the camera.
    """
    across = points[kp.LEFT_EAR] - points[kp.RIGHT_EAR]
    # Positive yaw turns the nose to the image's left and the person's right side out of sight.
    yaw_rad = math.atan2(-across[2], across[0])
    turned = np.array([-yaw_rad, yaw_rad])  # left and right side, away from the camera
    eyes = 1.0 - np.interp(turned, _EYE_HIDES_RAD, (0.0, 1.0))
    ears = 1.0 - np.interp(turned, _EAR_HIDES_RAD, (0.0, 1.0))
    return np.array([1.0, *eyes, *ears])


def _agree(before_px: FloatArray, face_px: FloatArray) -> bool:
    """Return whether a face lies where the pose network has it, and its nose points there."""
    size_px = max(
        float(np.linalg.norm(face_px[kp.LEFT_EAR] - face_px[kp.RIGHT_EAR])),
        _NOSE_SIZES * float(np.linalg.norm(face_px[1:3].mean(axis=0) - face_px[kp.NOSE])),
    )
    before, face = (each[kp.NOSE] - each[3:].mean(axis=0) for each in (before_px, face_px))
    aside_px = float(np.linalg.norm((before_px - face_px)[:3].mean(axis=0)))
    points_px = float(np.linalg.norm(before - face))
    return aside_px <= _FACE_APART * size_px and points_px <= _NOSE_APART * size_px


def _square(
    image: ImageRgb, centre_px: FloatArray, side_px: float, roll_rad: float, size_px: int
) -> tuple[NDArray[np.float32], FloatArray]:
    """Return a square of an image, (size, size, 3), and the map (2, 3) of its pixels to the image.

    Both count from the middle of the first pixel.
    """
    cos, sin = math.cos(roll_rad), math.sin(roll_rad)
    turn = np.array([[cos, -sin], [sin, cos]])
    crop = head_crop(image, centre_px, side_px, size_px, turn)
    steps = side_px / size_px * turn
    return crop.astype(np.float32), np.column_stack(
        [steps, centre_px - steps @ np.full(2, 0.5 * (size_px - 1))]
    )


def _members(content: bytes) -> list[bytes]:
    """Return the two networks of the file."""
    with zipfile.ZipFile(io.BytesIO(content)) as opened:
        return [opened.read(member) for member in (_DETECTOR, _MESH)]


def _named(model: TfliteModel, name: str, extents: tuple[int, ...]) -> tuple[str, ...]:
    """Return the names of a network's first outputs of so many numbers.

    Raises:
        PerceptionError: for a network without them.
    """
    found: Mapping[int, str] = {
        math.prod(extent or 0 for extent in tensor.shape): tensor.name
        for tensor in reversed(model.outputs)
    }
    if not set(extents) <= set(found):
        raise PerceptionError(
            f"{name} holds other networks than MediaPipe's face_landmarker.task: {model.layout}"
        )
    return tuple(found[extent] for extent in extents)
