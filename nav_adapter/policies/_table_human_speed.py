"""Assumed speed of a person from a table."""

from __future__ import annotations

from typing import ClassVar

from pydantic import model_validator

from tracking.config import StrictConfig

from .._errors import NavError
from ._table import Points, check_points, interpolated

_FASTEST_MPS = 10.0


class TableHumanSpeed(StrictConfig):
    """Assumed human speed interpolated in a table.

    Attributes:
        table_mps: pairs of α and speed in m/s, α rising, speed never: straight lines between them,
            level beyond them.
    """

    error: ClassVar[type[ValueError]] = NavError

    table_mps: Points

    @model_validator(mode="after")
    def _sound(self) -> TableHumanSpeed:
        check_points(self.table_mps, "table_mps", 0.0, _FASTEST_MPS, "m/s")
        return self

    def human_speed_mps(self, awareness_lower: float) -> float:
        """Assumed speed for a lower bound of α; non-increasing in it."""
        return interpolated(self.table_mps, awareness_lower)
