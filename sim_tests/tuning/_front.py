"""The policies that no other beats in both objectives, and which of them to look at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Point = tuple[float, float]


def front(points: Sequence[Point]) -> list[int]:
    """Rows of the points that no other dominates, by the first objective; of equals the first."""
    order = sorted(range(len(points)), key=lambda row: (points[row], row))
    best, rows = float("inf"), []
    for row in order:
        if points[row][1] < best:
            best = points[row][1]
            rows.append(row)
    return rows


def knee(points: Sequence[Point]) -> int:
    """Row of the point of a front that lies farthest from the line between its ends.

    Both objectives are scaled to [0, 1] over the front (Das 1999). The first of a front of one or
    two points.
    """
    if len(points) < 3:
        return 0
    values = np.array(points)
    span = np.ptp(values, axis=0)
    scaled = (values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    # On the way from (0, 1) to (1, 0), how far towards (0, 0).
    return int((1.0 - scaled.sum(axis=1)).argmax())
