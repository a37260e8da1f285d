"""The body keypoints of one person."""

from __future__ import annotations

from dataclasses import dataclass

from .arrays import FloatArray, finite_array, finite_number, set_fields
from .errors import PerceptionError
from .layouts import KeypointLayout, keypoint_layout


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
    """

    keypoints_px: FloatArray
    keypoints_root_m: FloatArray
    scores: FloatArray
    layout: str
    lifted: bool = True
    face_evidence: bool = True
    scale_relative_std: float = 0.0

    def __post_init__(self) -> None:
        count = keypoint_layout(self.layout).size
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
        )

    @property
    def indices(self) -> KeypointLayout:
        """Layout with the row of each named keypoint."""
        return keypoint_layout(self.layout)
