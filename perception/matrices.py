"""Small matrices in closed form: symmetric 2 × 2 ones, cross products and rotations."""

from __future__ import annotations

import math
from typing import Final, overload

import numpy as np

from .arrays import FloatArray

#: χ² with two degrees of freedom that is exceeded by chance in 0.1 % of cases.
CHI2_999: Final = 13.8


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


_IDENTITY: Final = np.eye(3)
# (3, 9): a vector times this gives the rows of its cross-product matrix, one after the other.
_SKEW: Final = np.array(
    [[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]],
    dtype=np.float64,
)


def skew(vectors: FloatArray) -> FloatArray:
    """Return cross-product matrices (…, 3, 3) of vectors (…, 3): ``skew(a) @ b == cross(a, b)``."""
    return np.asarray((vectors @ _SKEW).reshape(*vectors.shape, 3))


def rotation_exp(vectors: FloatArray) -> FloatArray:
    """Return rotations (…, 3, 3) of rotation vectors (…, 3), by Rodrigues' formula."""
    angle = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))[..., None, None]
    cross = skew(vectors)
    if np.minimum.reduce(angle, axis=None, initial=1.0) >= 1e-8:
        first, second = np.sin(angle) / angle, (1.0 - np.cos(angle)) / (angle * angle)
    else:
        small = angle < 1e-8
        safe = np.where(small, 1.0, angle)
        first = np.where(small, 1.0, np.sin(angle) / safe)
        second = np.where(small, 0.5, (1.0 - np.cos(angle)) / safe**2)
    return np.asarray(_IDENTITY + first * cross + second * (cross @ cross))


def rotation_log(rotations: FloatArray) -> FloatArray:
    """Return rotation vectors (…, 3), of length at most π, of rotations (…, 3, 3)."""
    trace = rotations[..., 0, 0] + rotations[..., 1, 1] + rotations[..., 2, 2]
    angle = np.arccos(np.minimum(np.maximum(0.5 * (trace - 1.0), -1.0), 1.0))
    axis = np.empty(rotations.shape[:-1])
    axis[..., 0] = rotations[..., 2, 1] - rotations[..., 1, 2]
    axis[..., 1] = rotations[..., 0, 2] - rotations[..., 2, 0]
    axis[..., 2] = rotations[..., 1, 0] - rotations[..., 0, 1]
    length = np.sqrt(np.einsum("...i,...i->...", axis, axis))
    if length.min(initial=1.0) > 1e-6:
        return np.asarray((angle / length)[..., None] * axis)
    # Near a half turn the antisymmetric part vanishes; the diagonal still gives the axis.
    diagonal = np.sqrt(np.maximum(0.5 * (1.0 + np.diagonal(rotations, axis1=-2, axis2=-1)), 0.0))
    turned = np.where(axis < 0.0, -diagonal, diagonal)
    usable = length > 1e-6
    unit = np.where(usable[..., None], axis / np.where(usable, length, 1.0)[..., None], turned)
    return np.asarray(np.where((angle < 1e-8)[..., None], 0.5 * axis, angle[..., None] * unit))
