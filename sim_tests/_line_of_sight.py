"""Straight lines on the floor plane, and the boxes in their way."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

# A line along an axis is given this much of the other direction, so that nothing is divided by 0.
_LEAST_M = 1e-9


def crosses_boxes(boxes_odom_m: FloatArray, start_m: Any, ends_m: Any) -> NDArray[np.bool_]:
    """Whether the lines from ``start_m`` (2,) to ``ends_m`` (K, 2) cross a box, (K,), by slabs.

    Args:
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max.
        start_m: (2,).
        ends_m: (K, 2).
    """
    origin = np.asarray(start_m, dtype=np.float64)
    along = np.asarray(ends_m, dtype=np.float64).reshape(-1, 2) - origin
    safe = np.where(np.abs(along) < _LEAST_M, _LEAST_M, along)[:, None]
    first = (boxes_odom_m[:, :2] - origin) / safe
    second = (boxes_odom_m[:, 2:] - origin) / safe
    enter = np.minimum(first, second).max(axis=2)
    leave = np.maximum(first, second).min(axis=2)
    return np.asarray(((enter < leave) & (leave > 0.0) & (enter < 1.0)).any(axis=1))
