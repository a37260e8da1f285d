"""Radius and assumed speed of a person, interpolated in tables over awareness."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import ClassVar, Final

from pydantic import Field, model_validator

from tracking.config import StrictConfig

from .._errors import NavError

_SMALLEST_M: Final = 0.01
_LARGEST_M: Final = 10.0
_FASTEST_MPS: Final = 10.0

Points = tuple[tuple[float, float], ...]


def _check_points(points: Points, name: str, low: float, high: float, unit: str) -> None:
    """Check that α rises from point to point and the value does not.

    Raises:
        ValueError: naming the field, what was given and what is valid.
    """
    if not points:
        raise ValueError(f"{name} must hold at least one [awareness, {unit}] pair")
    for alpha, value in points:
        if not 0.0 <= alpha <= 1.0:
            raise ValueError(f"{name}: awareness must lie in [0, 1], got {alpha:g}")
        if not low <= value <= high:
            raise ValueError(
                f"{name}: values must lie in [{low:g}, {high:g}] {unit}, got {value:g}"
            )
    for (alpha, value), (next_alpha, next_value) in pairwise(points):
        if next_alpha <= alpha:
            raise ValueError(f"{name}: awareness must rise, got {next_alpha:g} after {alpha:g}")
        if next_value > value:
            raise ValueError(
                f"{name}: values must not grow with awareness, got {next_value:g} {unit} after "
                f"{value:g} {unit}"
            )


def _interpolate(points: Sequence[tuple[float, float]], awareness_lower: float) -> float:
    """Return the value, linear between the points and constant beyond; NaN gives the first."""
    # Written so that NaN counts as unaware.
    if not awareness_lower > points[0][0]:
        return points[0][1]
    index = bisect_right(points, awareness_lower, key=lambda point: point[0])
    if index == len(points):
        return points[-1][1]
    (alpha, value), (next_alpha, next_value) = points[index - 1], points[index]
    share = (awareness_lower - alpha) / (next_alpha - alpha)
    return (1.0 - share) * value + share * next_value


class TableInflation(StrictConfig):
    """Radius interpolated in a table.

    Attributes:
        table_m: pairs of α and radius in metres. α must rise, the radius must not. Between the
            points the radius is linear, beyond them constant. Values below the floor act as the
            floor.
    """

    error: ClassVar[type[ValueError]] = NavError

    table_m: Points = Field(json_schema_extra={"low": _SMALLEST_M, "high": _LARGEST_M})

    @model_validator(mode="after")
    def _check_table(self) -> TableInflation:
        _check_points(self.table_m, "table_m", _SMALLEST_M, _LARGEST_M, "m")
        return self

    def radius_m(self, awareness_lower: float) -> float:
        """Return the radius for a lower bound of α; it does not increase with α."""
        return _interpolate(self.table_m, awareness_lower)


class TableHumanSpeed(StrictConfig):
    """Assumed human speed interpolated in a table.

    Attributes:
        table_mps: pairs of α and speed in m/s. α must rise, the speed must not. Between the points
            the speed is linear, beyond them constant.
    """

    error: ClassVar[type[ValueError]] = NavError

    table_mps: Points = Field(json_schema_extra={"low": 0.0, "high": _FASTEST_MPS})

    @model_validator(mode="after")
    def _check_table(self) -> TableHumanSpeed:
        _check_points(self.table_mps, "table_mps", 0.0, _FASTEST_MPS, "m/s")
        return self

    def human_speed_mps(self, awareness_lower: float) -> float:
        """Return the assumed speed for a lower bound of α; it does not increase with α."""
        return _interpolate(self.table_mps, awareness_lower)
