"""Lines of sight on the floor plan, without the physics world."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

# Smallest component of a direction, so that nothing is divided by 0.
_TINY_M: Final = 1e-9


def crosses_boxes(boxes_odom_m: FloatArray, start_m: Any, ends_m: Any) -> NDArray[np.bool_]:
    """Return (K,) whether the lines from ``start_m`` to ``ends_m`` cross any box on the floor plan.

    Args:
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max.
        start_m: (2,).
        ends_m: (K, 2).
    """
    origin = np.asarray(start_m, dtype=np.float64)
    along = np.asarray(ends_m, dtype=np.float64).reshape(-1, 2) - origin
    safe = np.where(np.abs(along) < _TINY_M, _TINY_M, along)[:, None]
    first = (boxes_odom_m[:, :2] - origin) / safe
    second = (boxes_odom_m[:, 2:] - origin) / safe
    enter = np.minimum(first, second).max(axis=2)
    leave = np.maximum(first, second).min(axis=2)
    return np.asarray(((enter < leave) & (leave > 0.0) & (enter < 1.0)).any(axis=1))
