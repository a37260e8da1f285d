"""Symmetric 2 × 2 matrices in closed form: inverse, larger eigenvalue, Mahalanobis distance."""

from __future__ import annotations

import math
from typing import overload

import numpy as np

from .arrays import FloatArray


def inverse_2x2(matrices: FloatArray) -> FloatArray:
    """Return the inverses of symmetric matrices (…, 2, 2)."""
    inverse = np.empty_like(matrices)
    xx, xy, yy = matrices[..., 0, 0], matrices[..., 0, 1], matrices[..., 1, 1]
    scale = 1.0 / (xx * yy - xy * xy)
    inverse[..., 0, 0] = yy * scale
    inverse[..., 1, 1] = xx * scale
    inverse[..., 0, 1] = inverse[..., 1, 0] = -xy * scale
    return inverse


def mahalanobis2(offsets: FloatArray, covariances: FloatArray) -> FloatArray:
    """Return squared Mahalanobis distances (…,) of offsets (…, 2) with covariances (…, 2, 2).

    Of a normal distribution they are χ² with two degrees of freedom.
    """
    inverse = inverse_2x2(covariances)
    x, y = offsets[..., 0], offsets[..., 1]
    return np.asarray(
        x * x * inverse[..., 0, 0] + 2.0 * x * y * inverse[..., 0, 1] + y * y * inverse[..., 1, 1]
    )


@overload
def larger_eigenvalue(xx: float, xy: float, yy: float) -> float: ...
@overload
def larger_eigenvalue(xx: FloatArray, xy: FloatArray, yy: FloatArray) -> FloatArray: ...
def larger_eigenvalue(
    xx: float | FloatArray, xy: float | FloatArray, yy: float | FloatArray
) -> float | FloatArray:
    """Return the larger eigenvalue of [[xx, xy], [xy, yy]], of floats or of arrays of one shape.

    Of a covariance it is the variance in the most uncertain direction.
    """
    if isinstance(xx, float) and isinstance(yy, float) and isinstance(xy, float):
        return 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
    return np.asarray(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy))
