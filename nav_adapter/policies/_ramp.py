"""The way from "unaware" to "aware" that the shipped policies share."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from tracking.config import StrictConfig

from .._errors import NavError


def smoothstep(position: float) -> float:
    """From 0 at 0 to 1 at 1 without a kink at either end; ``position`` lies in [0, 1]."""
    return min(position * position * (3.0 - 2.0 * position), 1.0)


class AwarenessRamp(StrictConfig):
    """A monotone blend over the lower bound of α: 0 is "unaware", 1 is "aware".

    Attributes:
        unaware_below: α up to which a person counts as fully unaware, in [0, 1).
        aware_above: α from which a person counts as fully aware, in (0, 1]. The robot stands 35°
            off the gaze at α = 0.6 with the default attention cone of 60°.
        shape: ``"smoothstep"`` (no kink at either end), ``"linear"``, ``"logistic"`` (most of the
            change about the middle) or ``"two_level"``: aware from ``aware_above`` on, and until α
            has fallen to ``unaware_below``; between the two the level stays what it was.
        steepness: of the logistic shape, dimensionless: its slope in the middle is about a quarter
            of this, over the span from ``unaware_below`` to ``aware_above``. It is scaled so that
            both ends are reached exactly.
    """

    error: ClassVar[type[ValueError]] = NavError

    unaware_below: float = Field(default=0.1, ge=0.0, lt=1.0)
    aware_above: float = Field(default=0.6, gt=0.0, le=1.0)
    shape: Literal["smoothstep", "linear", "logistic", "two_level"] = "smoothstep"
    steepness: float = Field(default=10.0, ge=1.0, le=50.0)

    @model_validator(mode="after")
    def _ordered(self) -> AwarenessRamp:
        if self.aware_above <= self.unaware_below:
            raise ValueError(
                f"aware_above must exceed unaware_below, got {self.aware_above:g} and "
                f"{self.unaware_below:g}"
            )
        return self

    def blend(self, awareness_lower: float) -> float:
        """Share of "aware" in [0, 1], non-decreasing in ``awareness_lower``; NaN gives 0.

        Without memory: two levels start from "unaware".
        """
        below, above = self.unaware_below, self.aware_above
        # Written this way round so that NaN counts as unaware.
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
            # A logistic curve is a tanh, which cannot overflow.
            half = 0.25 * self.steepness
            return min(
                max(0.5 + 0.5 * math.tanh(half * (2.0 * position - 1.0)) / math.tanh(half), 0.0),
                1.0,
            )
        return smoothstep(position)

    def holds(self, awareness_lower: float, held: bool) -> bool:
        """Whether a person stays at the aware level who was ``held`` there at the last sighting.

        True only for two levels. NaN and whatever has fallen to ``unaware_below`` let go at once.
        """
        if self.shape != "two_level":
            return False
        return awareness_lower >= self.aware_above or (
            held and awareness_lower > self.unaware_below
        )
