"""The interval in which a parameter is searched."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from tracking.config import StrictConfig

from .._errors import SimError


class Range(StrictConfig):
    """The interval in which a parameter is searched.

    Attributes:
        low: smallest value.
        high: largest value, above ``low``.
        log: search in the logarithm.
    """

    error: ClassVar[type[ValueError]] = SimError

    low: float
    high: float
    log: bool = Field(default=False)

    @model_validator(mode="after")
    def _ordered(self) -> Range:
        if self.high <= self.low:
            raise ValueError(f"high must exceed low, got {self.low:g} to {self.high:g}")
        if self.log and self.low <= 0.0:
            raise ValueError(f"low must be above 0 for log: true, got {self.low:g}")
        return self

    def clipped(self, value: float) -> float:
        """The value, or the nearer end."""
        return min(max(value, self.low), self.high)
