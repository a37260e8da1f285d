"""Checks at the door: arrays and numbers that enter a seam type are copied, verified and locked.

The four packages share these helpers so that every refusal reads the same: what was given, what is
valid, and the unit. Each caller passes the error class of its own package.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import PerceptionError

FloatArray = NDArray[np.float64]

# A rotation read from a file or sent over a wire carries rounding of about this size.
_ROTATION_TOLERANCE = 1e-4


def _shape_text(shape: tuple[int | str, ...]) -> str:
    inner = ", ".join(str(extent) for extent in shape)
    return f"({inner},)" if len(shape) == 1 else f"({inner})"


def finite_array(
    name: str,
    value: Any,
    shape: tuple[int | str, ...],
    error: type[ValueError] = PerceptionError,
) -> FloatArray:
    """Return a read-only float64 copy of ``value`` after checking its shape and finiteness.

    ``shape`` holds an int where the extent is fixed and a letter where it is free; equal letters
    must have equal extents. Raises ``error`` naming the field, what was given and what is valid.
    """
    try:
        array = np.array(value, dtype=np.float64, copy=True)
    except (TypeError, ValueError) as cause:
        raise error(
            f"{name} must be an array of numbers of shape {_shape_text(shape)}, "
            f"got {type(value).__name__}: {value!r:.80}"
        ) from cause
    free: dict[str, int] = {}
    fits = array.ndim == len(shape) and all(
        extent == (wanted if isinstance(wanted, int) else free.setdefault(wanted, extent))
        for extent, wanted in zip(array.shape, shape, strict=True)
    )
    if not fits:
        raise error(f"{name} must have shape {_shape_text(shape)}, got {array.shape}")
    if not np.isfinite(array).all():
        bad = int(array.size - np.isfinite(array).sum())
        raise error(f"{name} must be finite, got {bad} NaN or infinite value(s) of {array.size}")
    array.setflags(write=False)
    return array


def finite_number(
    name: str,
    value: Any,
    error: type[ValueError] = PerceptionError,
    *,
    minimum: float = -math.inf,
    maximum: float = math.inf,
    exclusive_minimum: bool = False,
) -> float:
    """Return ``value`` as a float after checking that it is finite and within its bounds."""
    try:
        number = float(value)
    except (TypeError, ValueError) as cause:
        raise error(
            f"{name} must be a number, got {type(value).__name__}: {value!r:.80}"
        ) from cause
    if not math.isfinite(number):
        raise error(f"{name} must be finite, got {number}")
    too_small = number <= minimum if exclusive_minimum else number < minimum
    if too_small or number > maximum:
        low = "(" if exclusive_minimum or math.isinf(minimum) else "["
        high = ")" if math.isinf(maximum) else "]"
        raise error(f"{name} must lie in {low}{minimum:g}, {maximum:g}{high}, got {number:g}")
    return number


def covariance_matrix(
    name: str, value: Any, size: int, error: type[ValueError] = PerceptionError
) -> FloatArray:
    """Return a read-only (size, size) symmetric, positive semi-definite covariance."""
    array = finite_array(name, value, (size, size), error)
    scale = max(float(np.abs(array).max()), 1e-12)
    if float(np.abs(array - array.T).max()) > 1e-6 * scale:
        raise error(
            f"{name} must be symmetric, got an asymmetry of {np.abs(array - array.T).max():g}"
        )
    lowest = float(np.linalg.eigvalsh(array)[0])
    if lowest < -1e-6 * scale:
        raise error(f"{name} must be positive semi-definite, got an eigenvalue of {lowest:g}")
    return array


def rotation_matrix(name: str, value: Any, error: type[ValueError] = PerceptionError) -> FloatArray:
    """Return a read-only (3, 3) rotation; it must be orthonormal with determinant +1."""
    array = finite_array(name, value, (3, 3), error)
    deviation = float(np.abs(array @ array.T - np.eye(3)).max())
    if deviation > _ROTATION_TOLERANCE or np.linalg.det(array) < 0.0:
        raise error(
            f"{name} must be a rotation (orthonormal, determinant +1), got a deviation of "
            f"{deviation:g} and determinant {np.linalg.det(array):g}"
        )
    return array


def rigid_transform(name: str, value: Any, error: type[ValueError] = PerceptionError) -> FloatArray:
    """Return a read-only (4, 4) rigid transform; translation in metres."""
    array = finite_array(name, value, (4, 4), error)
    if float(np.abs(array[3] - (0.0, 0.0, 0.0, 1.0)).max()) > 1e-9:
        raise error(f"{name} must have the last row (0, 0, 0, 1), got {array[3].tolist()}")
    rotation_matrix(f"{name}[:3, :3]", array[:3, :3], error)
    return array


def unit_vector(name: str, value: Any, error: type[ValueError] = PerceptionError) -> FloatArray:
    """Return a read-only (3,) unit vector; a length within 1e-3 of one is normalised."""
    array = finite_array(name, value, (3,), error)
    length = float(np.linalg.norm(array))
    if abs(length - 1.0) > 1e-3:
        raise error(f"{name} must be a unit vector, got length {length:g}")
    unit = np.asarray(array / length)
    unit.setflags(write=False)
    return unit


def set_fields(instance: object, **values: Any) -> None:
    """Assign checked values to the fields of a frozen dataclass from its ``__post_init__``."""
    for field, value in values.items():
        object.__setattr__(instance, field, value)
