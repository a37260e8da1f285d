"""A person found in an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from .arrays import FloatArray, finite_array, finite_number, set_fields
from .errors import PerceptionError

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
