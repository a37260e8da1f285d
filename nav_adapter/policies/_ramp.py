"""The blend from "unaware" to "aware" that the shipped policies share."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from tracking.config import StrictConfig

from .._errors import NavError


def smoothstep(position: float) -> float:
    """Return 3p² − 2p³ for ``position`` p in [0, 1], which has slope 0 at both ends."""
    return min(position * position * (3.0 - 2.0 * position), 1.0)


class AwarenessRamp(StrictConfig):
    """A monotone blend over the lower bound of α: 0 is "unaware", 1 is "aware".

    Attributes:
        unaware_below: α up to which a person counts as fully unaware, in [0, 1).
        aware_above: α from which a person counts as fully aware, in (0, 1]. With the default
            attention cone of 60°, the robot is 35° off the gaze at α = 0.6.
        shape: ``"smoothstep"`` (slope 0 at both ends), ``"linear"``, ``"logistic"`` (most of the
            change about the middle) or ``"two_level"``: aware from ``aware_above`` on, until α has
            fallen to ``unaware_below``; between the two the level does not change.
        steepness: of the logistic shape, dimensionless. Its slope in the middle is about a quarter
            of this, over the span from ``unaware_below`` to ``aware_above``. The curve is scaled to
            reach both ends exactly.
    """

    error: ClassVar[type[ValueError]] = NavError

    unaware_below: float = Field(default=0.1, ge=0.0, lt=1.0)
    aware_above: float = Field(default=0.6, gt=0.0, le=1.0)
    shape: Literal["smoothstep", "linear", "logistic", "two_level"] = "smoothstep"
    steepness: float = Field(default=10.0, ge=1.0, le=50.0)

    @model_validator(mode="after")
    def _check_thresholds(self) -> AwarenessRamp:
        if self.aware_above <= self.unaware_below:
            raise ValueError(
                f"aware_above must exceed unaware_below, got {self.aware_above:g} and "
                f"{self.unaware_below:g}"
            )
        return self

    def blend(self, awareness_lower: float) -> float:
        """Return the share of "aware" in [0, 1], which does not decrease with α; NaN gives 0.

        The two levels have no hysteresis here: the share is 1 from ``aware_above`` on.
        """
        below, above = self.unaware_below, self.aware_above
        # Written so that NaN counts as unaware.
        if not awareness_lower > below:
            return 0.0
        if awareness_lower >= above:
            return 1.0
        position = (awareness_lower - below) / (above - below)
        if self.shape == "two_level":
            return 0.0
        if self.shape == "linear":
            return min(position, 1.0)
        if self.shape == "logistic":
            # The logistic curve as a tanh, which cannot overflow.
            half = 0.25 * self.steepness
            return min(
                max(0.5 + 0.5 * math.tanh(half * (2.0 * position - 1.0)) / math.tanh(half), 0.0),
                1.0,
            )
        return smoothstep(position)

    def holds(self, awareness_lower: float, held: bool) -> bool:
        """Return whether a person is held at the aware level, with hysteresis.

        Always False unless the shape is two levels. An α of NaN or at most ``unaware_below`` ends
        the hold at once.

        Args:
            awareness_lower: lower bound of α.
            held: whether the person was held at the last sighting.
        """
        if self.shape != "two_level":
            return False
        return awareness_lower >= self.aware_above or (
            held and awareness_lower > self.unaware_below
        )
