"""The pose of a head in the camera frame."""

from __future__ import annotations

from dataclasses import dataclass

from .arrays import (
    FloatArray,
    covariance_matrix,
    finite_array,
    finite_number,
    given,
    rotation_matrix,
    set_fields,
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
