"""Values over awareness that somebody has written down point by point.

Radius of a person from a table.

Assumed speed of a person from a table.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import ClassVar

from pydantic import model_validator

from tracking.config import StrictConfig

from .._errors import NavError

Points = tuple[tuple[float, float], ...]


def check_points(points: Points, name: str, low: float, high: float, unit: str) -> None:
    """Refuse points that are not in order of α, or that grow with it.

    Raises:
        ValueError: naming the field, the value and what is valid.
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


def interpolated(points: Sequence[tuple[float, float]], awareness_lower: float) -> float:
    """Straight lines between the points, level beyond them; NaN gives the first value."""
    # Written this way round so that NaN counts as unaware.
    if not awareness_lower > points[0][0]:
        return points[0][1]
    index = bisect_right(points, awareness_lower, key=lambda point: point[0])
    if index == len(points):
        return points[-1][1]
    (alpha, value), (next_alpha, next_value) = points[index - 1], points[index]
    share = (awareness_lower - alpha) / (next_alpha - alpha)
    return (1.0 - share) * value + share * next_value


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
