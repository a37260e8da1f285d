"""An eye estimator that runs MediaPipe's attention mesh, which is trained on photographs.

It needs the extra ``awarenav[mediapipe]``, whose package contains the network. Beside the mesh of a
face it gives five points of each iris.

Source: Grishchenko et al., "Attention Mesh: High-fidelity Face Mesh Prediction in Real-time", 2020.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from ..._camera import Camera
from ..._stages import HeadPose
from ...anthropometry import EYES_HEAD_M, HEAD_CENTRE_HEAD_M
from ...arrays import FloatArray, ImageRgb
from ...eyes import EyeGaze, eyes_from_irises
from .._images import rgb_image
from ..heads import head_crop, looking_at, ray_focal_px
from ._mediapipe import CONFIDENCE, MediaPipeEstimator, without_protobuf_warnings

# Landmarks of the left and of the right eye: iris, corners, upper and lower lid.
_IRISES: Final = (473, 468)
_CORNERS: Final = ((362, 263), (133, 33))
_LIDS: Final = ((386, 374), (159, 145))
_LANDMARKS: Final = 478
# Side of the square about the head, and of its picture for the network.
_CROP_M: Final = 0.30
_CROP_PX: Final = 256
_MIN_DEPTH_M: Final = 0.1
# Smaller irises (diameter) show no direction; the network does not run.
_IRIS_M: Final = 0.0117
_MIN_IRIS_PX: Final = 2.5
# Farther from the camera, the far eye hides behind the nose and the mesh slips.
_MAX_HEAD_ANGLE_RAD: Final = math.radians(50.0)
# Lids that are closer together than this share of the eye's width are closed.
_MIN_OPENING: Final = 0.15
# Error of the mean place of both irises between the corners: in pixels of the image, and in metres
# however many pixels there are; across the head and along its height, where lids cover the irises.
_IRIS_STD_PX: Final = 0.25
_IRIS_STD_M: Final = (4e-4, 1.5e-3)


class MediaPipeEyeEstimator(MediaPipeEstimator):
    """Rotation of the eyes of near people, from MediaPipe's irises.

    Each head is processed alone, in a square cut about it, and each frame by itself. There is no
    result, and no run of the network, for an iris of less than 2.5 pixels across (2.6 m at 640
    pixels and 60°) or a head that is turned more than 50° away from the camera; and none where no
    face is found or the eyes are closed.

    An estimator serves one thread. Close it, or use it in a ``with`` block, to release its memory.

    Raises:
        PerceptionError: if MediaPipe is not installed; the message names the extra.
    """

    def _made(self, face_mesh: Any, pose: Any) -> tuple[Any, ...]:
        self._mesh = face_mesh.FaceMesh(
            static_image_mode=True,
            max_num_faces=1,
            refine_landmarks=True,
            min_detection_confidence=CONFIDENCE,
        )
        return (self._mesh,)

    def estimate(
        self, image_rgb: ImageRgb, camera: Camera, heads: tuple[HeadPose | None, ...]
    ) -> tuple[EyeGaze | None, ...]:
        """Return the rotation of each person's eyes in the head; None where it is not known.

        Args:
            image_rgb: (H, W, 3) uint8.
            camera: camera of the image.
            heads: head pose of each person.

        Raises:
            PerceptionError: for an image of another type or shape, and for a closed estimator.
        """
        image = rgb_image(image_rgb)
        self._require_open()
        with without_protobuf_warnings():
            return tuple(
                None if head is None else self._eyes(image, camera, head) for head in heads
            )

    def _eyes(self, image: ImageRgb, camera: Camera, head: HeadPose) -> EyeGaze | None:
        centre_m, eyes_m = (
            head.position_camera_m + head.rotation_camera_head @ place
            for place in (HEAD_CENTRE_HEAD_M, EYES_HEAD_M)
        )
        if centre_m[2] < _MIN_DEPTH_M or not _faces_camera(head):
            return None
        focal_px = ray_focal_px(camera)
        px_per_m = focal_px / float(np.linalg.norm(eyes_m))
        if px_per_m * _IRIS_M < _MIN_IRIS_PX:
            return None
        centre_px = camera.project(centre_m[None])
        if not np.isfinite(centre_px).all():
            return None
        axes, stretch = looking_at(camera, centre_px)
        side_px = _CROP_M * focal_px / float(np.linalg.norm(centre_m))
        crop = head_crop(image, centre_px[0], side_px, _CROP_PX, stretch[0])
        faces = self._mesh.process(crop).multi_face_landmarks
        if not faces or len(faces[0].landmark) < _LANDMARKS:
            return None
        offset = iris_offset(faces[0].landmark)
        if offset is None:
            return None
        return eyes_from_irises(
            offset * (side_px / px_per_m), axes[0], head, iris_std_m=iris_std_m(px_per_m)
        )


def iris_std_m(px_per_m: float) -> tuple[float, float]:
    """Return standard deviations of the mean offset of both irises, across and along the head."""
    across, along = _IRIS_STD_M
    pixels_m = _IRIS_STD_PX / px_per_m
    return math.hypot(pixels_m, across), math.hypot(pixels_m, along)


def iris_offset(marks: Any) -> FloatArray | None:
    """Return (2,) the mean offset of both irises from the midpoints of the corners of their eyes.

    It is in sides of the square crop. None for closed eyes and for landmarks that are not finite.
    """
    rows = np.array([*_IRISES, *np.ravel(_CORNERS), *np.ravel(_LIDS)])
    points = np.array([(marks[row].x, marks[row].y) for row in rows])
    if not np.isfinite(points).all():
        return None
    irises, corners, lids = points[:2], points[2:6].reshape(2, 2, 2), points[6:].reshape(2, 2, 2)
    width = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1)
    opening = np.linalg.norm(lids[:, 0] - lids[:, 1], axis=1)
    if not (opening > _MIN_OPENING * width).all():
        return None
    return np.asarray((irises - corners.mean(axis=1)).mean(axis=0))


def _faces_camera(head: HeadPose) -> bool:
    """Return True for a head that is turned less than 50° away from the camera."""
    away = float(head.gaze_camera @ head.position_camera_m)
    range_m = float(np.linalg.norm(head.position_camera_m))
    return -away > math.cos(_MAX_HEAD_ANGLE_RAD) * range_m
