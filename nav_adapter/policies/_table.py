"""Values over awareness that somebody has written down point by point."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise

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
