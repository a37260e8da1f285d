"""One person in one frame: the type that perception hands over to tracking."""

from __future__ import annotations

from dataclasses import dataclass

from .arrays import (
    FloatArray,
    covariance_matrix,
    finite_array,
    finite_number,
    set_fields,
    unit_vector,
)
from .errors import PerceptionError


@dataclass(frozen=True, slots=True, eq=False)
class PersonObservation:
    """One person in one frame.

    Attributes:
        stamp_s: time of the frame.
        position_camera_m: (3,) centre line of the body at chest height, in the camera frame.
        position_covariance_m2: (3, 3) covariance of the position.
        gaze_camera: (3,) unit vector of the head's forward axis in the camera frame, or None
            without evidence.
        awareness: α in [0, 1], eqs. (1)–(3) of the paper, or None without evidence.
        awareness_std: standard deviation of α, ≥ 0; None if and only if ``awareness`` is None.
        score: confidence of the detection in [0, 1].
        box_xyxy_px: (4,) left, top, right, bottom in the image, or None without an image.
    """

    stamp_s: float
    position_camera_m: FloatArray
    position_covariance_m2: FloatArray
    gaze_camera: FloatArray | None
    awareness: float | None
    awareness_std: float | None
    score: float
    box_xyxy_px: FloatArray | None = None

    def __post_init__(self) -> None:
        if (self.awareness is None) != (self.awareness_std is None):
            raise PerceptionError(
                "awareness and awareness_std must both be given or both be None, got "
                f"awareness={self.awareness}, awareness_std={self.awareness_std}"
            )
        gaze, alpha, std, box = (
            self.gaze_camera,
            self.awareness,
            self.awareness_std,
            self.box_xyxy_px,
        )
        set_fields(
            self,
            stamp_s=finite_number("stamp_s", self.stamp_s),
            position_camera_m=finite_array("position_camera_m", self.position_camera_m, (3,)),
            position_covariance_m2=covariance_matrix(
                "position_covariance_m2", self.position_covariance_m2, 3
            ),
            gaze_camera=None if gaze is None else unit_vector("gaze_camera", gaze),
            awareness=None
            if alpha is None
            else finite_number("awareness", alpha, minimum=0.0, maximum=1.0),
            awareness_std=None if std is None else finite_number("awareness_std", std, minimum=0.0),
            score=finite_number("score", self.score, minimum=0.0, maximum=1.0),
            box_xyxy_px=None if box is None else finite_array("box_xyxy_px", box, (4,)),
        )
