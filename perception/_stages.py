"""The stages of the pipeline: what each hands over, and the interfaces that any object can have."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

from ._camera import Camera
from .arrays import (
    FloatArray,
    ImageRgb,
    covariance_matrix,
    finite_array,
    finite_number,
    given,
    rotation_matrix,
    set_fields,
)
from .errors import PerceptionError
from .layouts import keypoint_count

#: People with a lower score are not reported by default.
DEFAULT_SCORE_THRESHOLD: Final = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class PersonDetection:
    """The box of one person in pixels.

    Attributes:
        box_xyxy_px: (4,) left, top, right, bottom; right ≥ left and bottom ≥ top.
        score: confidence of the detection in [0, 1].
    """

    box_xyxy_px: FloatArray
    score: float

    def __post_init__(self) -> None:
        box = finite_array("box_xyxy_px", self.box_xyxy_px, (4,))
        if box[2] < box[0] or box[3] < box[1]:
            raise PerceptionError(
                "box_xyxy_px must be left, top, right, bottom with right >= left and "
                f"bottom >= top, got {box.tolist()}"
            )
        set_fields(
            self,
            box_xyxy_px=box,
            score=finite_number("score", self.score, minimum=0.0, maximum=1.0),
        )


@dataclass(frozen=True, slots=True, eq=False)
class PersonKeypoints:
    """Keypoints of one person in the image, and in 3-D relative to the body's root.

    Attributes:
        keypoints_px: (K, 2) pixel coordinates u, v.
        keypoints_root_m: (K, 3) positions in metres in camera axes (x right, y down, z forward),
            relative to the body's root (mid-hip). A 3-D output without a unit is accepted too: the
            pipeline computes the scale from the limb lengths.
        scores: (K,) confidence of each keypoint in [0, 1]; 0 for a keypoint that is not seen.
        layout: ``"coco"`` (K = 17) or ``"coco_wholebody"`` (K = 133).
        lifted: False for a 2-D network, whose ``keypoints_root_m`` is flat: x and y follow the
            pixels, z is 0. Limbs that point at the camera then look short; the scale comes from
            the others.
        face_evidence: False if high scores of nose and eyes do not mean that the face is seen.
            MediaPipe Pose, for example, gives scores near 1 on backs of heads; its face network
            found none then.
        scale_relative_std: relative standard deviation of the size of the whole skeleton from the
            estimator's noise, beyond the spread of statures and limbs of adults.
        eyes_open: False if lids cover the irises: the eyes blink or look down.
        face_points_m: (5, 3) places of nose, eyes and ears in the head frame (:class:`HeadPose`),
            where a network of faces has placed them: its points of a head are others than COCO's
            (:data:`~perception.anthropometry.HEAD_TEMPLATE_M`), and tell its range. None without
            such a network, or a face.
        irises_px: (2,) mean offset of both irises from the midpoints of the corners of their eyes;
            None if no network has placed them, or lids cover one.
    """

    keypoints_px: FloatArray
    keypoints_root_m: FloatArray
    scores: FloatArray
    layout: str
    lifted: bool = True
    face_evidence: bool = True
    scale_relative_std: float = 0.0
    eyes_open: bool = True
    face_points_m: FloatArray | None = None
    irises_px: FloatArray | None = None

    def __post_init__(self) -> None:
        count = keypoint_count(self.layout)
        scores = finite_array("scores", self.scores, (count,))
        if scores.min() < 0.0 or scores.max() > 1.0:
            raise PerceptionError(
                f"scores must lie in [0, 1], got {scores.min():g} to {scores.max():g}"
            )
        set_fields(
            self,
            keypoints_px=finite_array("keypoints_px", self.keypoints_px, (count, 2)),
            keypoints_root_m=finite_array("keypoints_root_m", self.keypoints_root_m, (count, 3)),
            scores=scores,
            lifted=bool(self.lifted),
            face_evidence=bool(self.face_evidence),
            scale_relative_std=finite_number(
                "scale_relative_std", self.scale_relative_std, minimum=0.0
            ),
            eyes_open=bool(self.eyes_open),
            face_points_m=given(finite_array, "face_points_m", self.face_points_m, (5, 3)),
            irises_px=given(finite_array, "irises_px", self.irises_px, (2,)),
        )


@dataclass(frozen=True, slots=True, eq=False)
class HeadPose:
    """Position and direction of a head.

    The head frame is the paper's: origin at the nose, y forward (the gaze), z towards the person's
    right ear, x = y × z (downwards for an upright head). ``p_camera = rotation_camera_head @ p_head
    + position_camera_m``.

    Attributes:
        position_camera_m: (3,) the nose, in the camera frame.
        rotation_camera_head: (3, 3) from the head frame to the camera frame.
        covariance: (6, 6), order rotation vector (rad), position (m). The rotation error δ is a
            small rotation in camera axes: ``R_true = exp(δ) @ rotation_camera_head``.
        reprojection_error_px: root mean square error of the points used.
        face_seen: probability that the camera sees the face (two of nose and eyes), if the
            estimator gives one; None leaves it to the scores of the keypoints.
        range_relative_std: relative standard deviation of the range |position|, if it is measured
            from the head itself. None if the range comes from the body, or from an assumed head
            size whose spread is not included; then it is no cue for the body's position.
    """

    position_camera_m: FloatArray
    rotation_camera_head: FloatArray
    covariance: FloatArray
    reprojection_error_px: float
    face_seen: float | None = None
    range_relative_std: float | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            position_camera_m=finite_array("position_camera_m", self.position_camera_m, (3,)),
            rotation_camera_head=rotation_matrix("rotation_camera_head", self.rotation_camera_head),
            covariance=covariance_matrix("covariance", self.covariance, 6),
            reprojection_error_px=finite_number(
                "reprojection_error_px", self.reprojection_error_px, minimum=0.0
            ),
            face_seen=given(finite_number, "face_seen", self.face_seen, minimum=0.0, maximum=1.0),
            range_relative_std=given(
                finite_number,
                "range_relative_std",
                self.range_relative_std,
                minimum=0.0,
                exclusive_minimum=True,
            ),
        )

    @property
    def gaze_camera(self) -> FloatArray:
        """Unit vector (3,) along the head's forward axis, in the camera frame."""
        return self.rotation_camera_head[:, 1]

    @property
    def off_camera_rad(self) -> float:
        """Angle between the gaze and the direction to the camera, in [0, π]."""
        x, y, z = self.position_camera_m.tolist()
        along = float(self.gaze_camera @ self.position_camera_m)
        return math.acos(min(max(-along / max(math.hypot(x, y, z), 1e-9), -1.0), 1.0))


@runtime_checkable
class PersonDetector(Protocol):
    """Interface: finds people in an image."""

    def detect(self, image_rgb: ImageRgb) -> tuple[PersonDetection, ...]:
        """Return the people in an (H, W, 3) RGB image; an empty tuple if there are none."""
        ...


@runtime_checkable
class PoseEstimator(Protocol):
    """Interface: finds the keypoints of detected people."""

    def estimate(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return one set of keypoints per detection, in the same order."""
        ...


@runtime_checkable
class HeadPoseEstimator(Protocol):
    """Interface: finds the head poses of people whose keypoints are known."""

    def estimate(
        self, image_rgb: ImageRgb, camera: Camera, people: tuple[PersonKeypoints, ...]
    ) -> tuple[HeadPose | None, ...]:
        """Return one head pose per person, in the same order; None where there is no evidence."""
        ...


def check_count(name: str, got: int, wanted: int) -> None:
    """Raise PerceptionError unless an estimator returned one result per person."""
    if got != wanted:
        raise PerceptionError(f"{name} must return one result per person ({wanted}), got {got}")
