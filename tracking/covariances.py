"""Covariances of place and velocity, x, y, vx, vy, as plain numbers, and as they are later."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, TypeAlias, TypeVar

import numpy as np

from perception.arrays import FloatArray

_Value = TypeVar("_Value", float, FloatArray)
#: The upper triangle of a covariance of x, y, vx, vy, row by row.
Upper: TypeAlias = tuple[
    _Value, _Value, _Value, _Value, _Value, _Value, _Value, _Value, _Value, _Value
]

# Where each element of the covariance is in its upper triangle.
_PLACES: Final = np.array([[0, 1, 2, 3], [1, 4, 5, 6], [2, 5, 7, 8], [3, 6, 8, 9]])


def drifted(upper: Upper[_Value], dt_s: _Value) -> Upper[_Value]:
    """Return F P Fᵀ: a covariance after ``dt_s`` at constant velocity; numbers, or arrays of them.

    It has no process noise. Tracker, prediction and navigation all move a track on with it.
    """
    xx, xy, xu, xv, yy, yu, yv, uu, uv, vv = upper
    return (
        xx + dt_s * (2.0 * xu + dt_s * uu),
        xy + dt_s * (yu + xv + dt_s * uv),
        xu + dt_s * uu,
        xv + dt_s * uv,
        yy + dt_s * (2.0 * yv + dt_s * vv),
        yu + dt_s * uv,
        yv + dt_s * vv,
        uu,
        uv,
        vv,
    )


def matrices(uppers: Sequence[Upper[float]]) -> FloatArray:
    """Return the covariances (N, 4, 4) of N upper triangles, N ≥ 1."""
    return np.array(uppers)[:, _PLACES]
