"""One person in one frame: the type that perception hands over to tracking."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ._stages import PersonKeypoints
from .arrays import (
    FloatArray,
    covariance_matrix,
    finite_array,
    finite_number,
    given,
    set_fields,
    unit_vector,
)
from .errors import PerceptionError
from .evidence import AWARENESS_REASONS, AwarenessReason


@dataclass(frozen=True, slots=True, eq=False)
class PersonObservation:
    """One person in one frame.

    Attributes:
        stamp_s: time of the frame.
        position_camera_m: (3,) centre line of the body at chest height, in the camera frame.
        position_covariance_m2: (3, 3) covariance of the position.
        gaze_camera: (3,) unit vector of the gaze in the camera frame: the head's forward axis, or
            with ``eyes_seen`` that of the eyes. None without evidence, and where no face is seen
            and the head's direction is unknown.
        awareness: α in [0, 1], eqs. (1)–(3) of the paper, or None without evidence.
        awareness_std: standard deviation of α, ≥ 0; None if and only if ``awareness`` is None.
        score: confidence of the detection in [0, 1].
        box_xyxy_px: (4,) left, top, right, bottom in the image, or None without an image.
        awareness_reason: why ``awareness`` is None, one of :data:`AWARENESS_REASONS`; None if it is
            not, or if the reason is unknown.
        range_lasting_relative_std: the part of the range's relative standard deviation that is the
            same in every frame of this person, because their size is not known; in
            ``position_covariance_m2`` it is σ² p pᵀ. 0 for a measured range.
        size_range_m: range at which an adult who stands would have the size of this person in the
            image, before other cues; None if no size was assumed.
        size_range_relative_std: its relative standard deviation, that of the person's size left
            out; None if and only if ``size_range_m`` is None.
        eyes_seen: True if gaze and awareness contain a measurement of the eyes in the head. False:
            the eyes may look elsewhere than the head, and ``awareness_std`` says how far.
        keypoints: in the image, those of a head that is not their own with score 0; None if none
            are the person's.
    """

    stamp_s: float
    position_camera_m: FloatArray
    position_covariance_m2: FloatArray
    gaze_camera: FloatArray | None
    awareness: float | None
    awareness_std: float | None
    score: float
    box_xyxy_px: FloatArray | None = None
    awareness_reason: AwarenessReason | None = None
    range_lasting_relative_std: float = 0.0
    size_range_m: float | None = None
    size_range_relative_std: float | None = None
    eyes_seen: bool = False
    keypoints: PersonKeypoints | None = None

    def __post_init__(self) -> None:
        if (self.awareness is None) != (self.awareness_std is None):
            raise PerceptionError(
                "awareness and awareness_std must both be given or both be None, got "
                f"awareness={self.awareness}, awareness_std={self.awareness_std}"
            )
        if self.awareness_reason is not None and (
            self.awareness is not None or self.awareness_reason not in AWARENESS_REASONS
        ):
            raise PerceptionError(
                f"awareness_reason must be one of {', '.join(map(repr, AWARENESS_REASONS))}, and "
                f"None with an awareness, got {self.awareness_reason!r} with "
                f"awareness={self.awareness}"
            )
        if (self.size_range_m is None) != (self.size_range_relative_std is None):
            raise PerceptionError(
                "size_range_m and size_range_relative_std must both be given or both be None, got "
                f"{self.size_range_m} and {self.size_range_relative_std}"
            )
        set_fields(
            self,
            stamp_s=finite_number("stamp_s", self.stamp_s),
            position_camera_m=finite_array("position_camera_m", self.position_camera_m, (3,)),
            position_covariance_m2=covariance_matrix(
                "position_covariance_m2", self.position_covariance_m2, 3
            ),
            gaze_camera=given(unit_vector, "gaze_camera", self.gaze_camera),
            awareness=given(finite_number, "awareness", self.awareness, minimum=0.0, maximum=1.0),
            awareness_std=given(finite_number, "awareness_std", self.awareness_std, minimum=0.0),
            score=finite_number("score", self.score, minimum=0.0, maximum=1.0),
            box_xyxy_px=given(finite_array, "box_xyxy_px", self.box_xyxy_px, (4,)),
            range_lasting_relative_std=finite_number(
                "range_lasting_relative_std", self.range_lasting_relative_std, minimum=0.0
            ),
            size_range_m=given(
                finite_number,
                "size_range_m",
                self.size_range_m,
                minimum=0.0,
                exclusive_minimum=True,
            ),
            size_range_relative_std=given(
                finite_number, "size_range_relative_std", self.size_range_relative_std, minimum=0.0
            ),
            eyes_seen=bool(self.eyes_seen),
        )

    def rotated(self, rotation: FloatArray) -> PersonObservation:
        """Return the observation in another frame with the same origin; pixels stay as they are.

        Args:
            rotation: (3, 3) from this frame to the other.
        """
        covariance = rotation @ self.position_covariance_m2 @ rotation.T
        return replace(
            self,
            position_camera_m=rotation @ self.position_camera_m,
            position_covariance_m2=0.5 * (covariance + covariance.T),
            gaze_camera=None if self.gaze_camera is None else rotation @ self.gaze_camera,
        )

    @classmethod
    def true(
        cls,
        stamp_s: float,
        position_camera_m: FloatArray,
        position_covariance_m2: FloatArray,
        gaze_camera: FloatArray,
        awareness: float,
        awareness_std: float,
    ) -> PersonObservation:
        """Return the observation that a simulator makes of a person whose truth it knows.

        Nothing is checked or copied, which takes a fifth of the time: the arrays must be valid,
        read-only float64, and all numbers floats within their ranges. The score is 1.
        """
        observation = object.__new__(cls)
        set_fields(
            observation,
            stamp_s=stamp_s,
            position_camera_m=position_camera_m,
            position_covariance_m2=position_covariance_m2,
            gaze_camera=gaze_camera,
            awareness=awareness,
            awareness_std=awareness_std,
            score=1.0,
            box_xyxy_px=None,
            awareness_reason=None,
            range_lasting_relative_std=0.0,
            size_range_m=None,
            size_range_relative_std=None,
            eyes_seen=False,
            keypoints=None,
        )
        return observation
