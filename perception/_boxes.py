"""Boxes (4,) left, top, right, bottom in pixels: their areas, overlaps, and those of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .arrays import FloatArray


def extent(points: FloatArray, seen: NDArray[np.bool_]) -> FloatArray:
    """Return the box (4,) of the seen ones of points (K, 2), of which there is at least one."""
    shown = points[seen]
    return np.concatenate([shown.min(axis=0), shown.max(axis=0)])


def area(box: FloatArray) -> float:
    """Return the area of a box; 0 if it has no extent."""
    left, top, right, bottom = box.tolist()
    return float(max(right - left, 0.0) * max(bottom - top, 0.0))


def common_area(first: FloatArray, second: FloatArray) -> float:
    """Return the area that two boxes share."""
    low, high = np.maximum(first[:2], second[:2]), np.minimum(first[2:], second[2:])
    across, down = (high - low).tolist()
    return float(max(across, 0.0) * max(down, 0.0))


def iou(first: FloatArray, second: FloatArray) -> float:
    """Return the intersection over union of two boxes."""
    common = common_area(first, second)
    return common / max(area(first) + area(second) - common, 1e-9)
