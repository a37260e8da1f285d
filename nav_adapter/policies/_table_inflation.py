"""Radius of a person from a table."""

from __future__ import annotations

from typing import ClassVar

from pydantic import model_validator

from tracking.config import StrictConfig

from .._errors import NavError
from ._table import Points, check_points, interpolated

_SMALLEST_M = 0.01
_LARGEST_M = 10.0


class TableInflation(StrictConfig):
    """Radius interpolated in a table.

    Attributes:
        table_m: pairs of α and radius in metres, α rising, radius never: straight lines between
            them, level beyond them. Values below the floor act as the floor.
    """

    error: ClassVar[type[ValueError]] = NavError

    table_m: Points

    @model_validator(mode="after")
    def _sound(self) -> TableInflation:
        check_points(self.table_m, "table_m", _SMALLEST_M, _LARGEST_M, "m")
        return self

    def radius_m(self, awareness_lower: float) -> float:
        """Radius for a lower bound of α; non-increasing in it."""
        return interpolated(self.table_m, awareness_lower)
