"""Who counts when estimates are judged, and what good estimates are."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field, ValidationError

from tracking.config import StrictConfig

from .._errors import SimError


class JudgeConfig(StrictConfig):
    """Who had to be found: people at least so tall, at most so hidden and so cut off.

    Everybody else is neither a miss when overlooked nor a mistake when found.

    Attributes:
        min_height_px: of the true box.
        max_occlusion: share of the person that something else hides, exclusive.
        max_truncation: share of the person outside the picture, exclusive.
    """

    error: ClassVar[type[ValueError]] = SimError

    min_height_px: float = Field(default=40.0, ge=0.0)
    max_occlusion: float = Field(default=0.5, gt=0.0, le=1.0)
    max_truncation: float = Field(default=0.5, gt=0.0, le=1.0)

    @classmethod
    def checked(cls, **values: Any) -> JudgeConfig:
        """Validate settings given one by one; raises SimError that names each wrong one."""
        try:
            return cls(**values)
        except ValidationError as cause:
            wrong = (
                f"{'.'.join(map(str, each['loc']))}: {each['msg']}, got {each['input']!r}"
                for each in cause.errors()
            )
            raise SimError("; ".join(wrong)) from cause


class JudgeLimits(StrictConfig):
    """What the project asks of its own networks on rendered people; ``--gate`` holds them to it.

    Attributes:
        min_ap50: average precision of detection at IoU ≥ 0.5.
        max_gaze_median_deg: error of the head's direction.
        max_gaze_p90_deg: its 90th percentile.
        max_position_median: error of position as a share of range.
        max_awareness_mae: mean absolute error of α.
        max_false_aware: share of α ≥ 0.5 among estimated α whose truth is 0.
        within_1sigma: share of |α error| within one reported standard deviation (a normal
            distribution has 0.68), for a truth or an estimate strictly between 0 and 1.
        within_1sigma_tolerance: by how much it may differ.
    """

    error: ClassVar[type[ValueError]] = SimError

    min_ap50: float = 0.97
    max_gaze_median_deg: float = 5.0
    max_gaze_p90_deg: float = 15.0
    max_position_median: float = 0.04
    max_awareness_mae: float = 0.08
    max_false_aware: float = 0.005
    within_1sigma: float = 0.68
    within_1sigma_tolerance: float = 0.08
