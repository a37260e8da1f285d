"""The way from "unaware" to "aware" that the shipped policies share."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field, model_validator

from tracking.config import StrictConfig

from .._errors import NavError


class AwarenessRamp(StrictConfig):
    """A monotone blend over the lower bound of α: 0 is "unaware", 1 is "aware".

    Attributes:
        unaware_below: α up to which a person counts as fully unaware, in [0, 1).
        aware_above: α from which a person counts as fully aware, in (0, 1]. The robot stands 35°
            off the gaze at α = 0.6 with the default attention cone of 60°.
        shape: ``"smoothstep"`` (no kink at either end) or ``"linear"``.
    """

    error: ClassVar[type[ValueError]] = NavError

    unaware_below: float = Field(default=0.1, ge=0.0, lt=1.0)
    aware_above: float = Field(default=0.6, gt=0.0, le=1.0)
    shape: Literal["smoothstep", "linear"] = "smoothstep"

    @model_validator(mode="after")
    def _ordered(self) -> AwarenessRamp:
        if self.aware_above <= self.unaware_below:
            raise ValueError(
                f"aware_above must exceed unaware_below, got {self.aware_above:g} and "
                f"{self.unaware_below:g}"
            )
        return self

    def blend(self, awareness_lower: float) -> float:
        """Share of "aware" in [0, 1], non-decreasing in ``awareness_lower``; NaN gives 0."""
        span = self.aware_above - self.unaware_below
        position = (awareness_lower - self.unaware_below) / span
        # Written this way round so that NaN counts as unaware.
        if not position > 0.0:
            return 0.0
        if position >= 1.0:
            return 1.0
        if self.shape == "linear":
            return position
        return position * position * (3.0 - 2.0 * position)
