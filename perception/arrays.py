"""Checks of numbers and arrays: each value is verified, and arrays are copied and made read-only.

All packages share these helpers, so that all error messages have the same form: what was given,
what is valid, and the unit. A caller passes the error class of its own package.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from operator import mul
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .errors import PerceptionError

_T = TypeVar("_T")

FloatArray = NDArray[np.float64]
#: (H, W, 3) uint8 in the order red, green, blue.
ImageRgb = NDArray[np.uint8]

# Rounding of a rotation that was read from a file or sent in a message.
_ROTATION_TOLERANCE = 1e-4
_FEW_NUMBERS = 64
_LAST_ROW = (0.0, 0.0, 0.0, 1.0)


def _shape_text(shape: tuple[int | str, ...]) -> str:
    inner = ", ".join(str(extent) for extent in shape)
    return f"({inner},)" if len(shape) == 1 else f"({inner})"


def _fits(given: tuple[int, ...], wanted: tuple[int | str, ...]) -> bool:
    """Return True if the extents agree; a letter is any extent, equal letters are equal extents."""
    free: dict[str, int] = {}
    return len(given) == len(wanted) and all(
        extent == (want if isinstance(want, int) else free.setdefault(want, extent))
        for extent, want in zip(given, wanted, strict=True)
    )


def _all_finite(array: FloatArray) -> bool:
    # Plain Python is faster for few numbers. If their sum is finite, so are all numbers; if it is
    # not (non-finite or very large numbers), NumPy decides.
    if array.size <= _FEW_NUMBERS and math.isfinite(sum(array.ravel().tolist())):
        return True
    return bool(np.isfinite(array).all())


def finite_array(
    name: str,
    value: Any,
    shape: tuple[int | str, ...],
    error: type[ValueError] = PerceptionError,
) -> FloatArray:
    """Return a read-only float64 copy of ``value`` after checking its shape and finiteness.

    Args:
        name: name of the value in messages.
        value: anything that NumPy converts to an array of numbers.
        shape: an int for a fixed extent, a letter for a free one; equal letters must have equal
            extents.
        error: class of the error to raise.
    """
    try:
        array = np.array(value, dtype=np.float64, copy=True)
    except (TypeError, ValueError, OverflowError) as cause:
        raise error(
            f"{name} must be an array of numbers of shape {_shape_text(shape)}, "
            f"got {type(value).__name__}: {value!r:.80}"
        ) from cause
    if array.shape != shape and not _fits(array.shape, shape):
        raise error(f"{name} must have shape {_shape_text(shape)}, got {array.shape}")
    if not _all_finite(array):
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
    """Return ``value`` as a float after checking that it is finite and within the bounds.

    True and False are no numbers: YAML reads ``off`` as False.
    """
    if type(value) is float and minimum < value < maximum:  # the usual case, in short
        return value
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError, OverflowError) as cause:
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


def boxes_on_floor(name: str, value: Any, error: type[ValueError] = PerceptionError) -> FloatArray:
    """Return boxes (N, 4) x_min, y_min, x_max, y_max in metres.

    Raises:
        error: for another shape, a number that is not finite, or a minimum not below its maximum.
    """
    boxes = finite_array(name, value, ("N", 4), error)
    wrong = np.flatnonzero((boxes[:, :2] >= boxes[:, 2:]).any(axis=1))
    if len(wrong):
        row = int(wrong[0])
        raise error(
            f"{name} must hold x_min < x_max and y_min < y_max in metres, row {row} is "
            f"{boxes[row].tolist()}"
        )
    return boxes


def covariance_matrix(
    name: str, value: Any, size: int, error: type[ValueError] = PerceptionError
) -> FloatArray:
    """Return a read-only (size, size) symmetric, positive semi-definite covariance."""
    array = finite_array(name, value, (size, size), error)
    if _has_cholesky_factor(array.tolist()):
        return array
    scale = max(float(np.abs(array).max()), 1e-12)
    if float(np.abs(array - array.T).max()) > 1e-6 * scale:
        raise error(
            f"{name} must be symmetric, got an asymmetry of {np.abs(array - array.T).max():g}"
        )
    lowest = float(np.linalg.eigvalsh(array)[0])
    if lowest < -1e-6 * scale:
        raise error(f"{name} must be positive semi-definite, got an eigenvalue of {lowest:g}")
    return array


def _has_cholesky_factor(rows: list[list[float]]) -> bool:
    """Return True for an exactly symmetric, positive definite matrix.

    A matrix with False may still be valid within the tolerances. In plain Python this is faster
    than LAPACK for small matrices.
    """
    factor: list[list[float]] = []
    for size, row in enumerate(rows):
        new: list[float] = []
        for column in range(size):
            if row[column] != rows[column][size]:
                return False
            known = factor[column]
            new.append((row[column] - sum(map(mul, new, known))) / known[column])
        left = row[size] - sum(map(mul, new, new))
        if not left > 0.0:
            return False
        new.append(math.sqrt(left))
        factor.append(new)
    return True


def rotation_matrix(name: str, value: Any, error: type[ValueError] = PerceptionError) -> FloatArray:
    """Return a read-only (3, 3) rotation matrix: orthonormal, determinant +1."""
    array = finite_array(name, value, (3, 3), error)
    _check_rotation(name, array.tolist(), error)
    return array


def _check_rotation(name: str, rows: list[list[float]], error: type[ValueError]) -> None:
    a, b, c = rows
    deviation = max(
        abs(_dot(a, a) - 1.0),
        abs(_dot(b, b) - 1.0),
        abs(_dot(c, c) - 1.0),
        abs(_dot(a, b)),
        abs(_dot(a, c)),
        abs(_dot(b, c)),
    )
    normal = (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0])
    determinant = _dot(a, normal)
    if deviation > _ROTATION_TOLERANCE or determinant < 0.0:
        raise error(
            f"{name} must be a rotation (orthonormal, determinant +1), got a deviation of "
            f"{deviation:g} and determinant {determinant:g}"
        )


def _dot(first: Sequence[float], second: Sequence[float]) -> float:
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def rigid_transform(name: str, value: Any, error: type[ValueError] = PerceptionError) -> FloatArray:
    """Return a read-only (4, 4) rigid transform, translation in metres."""
    array = finite_array(name, value, (4, 4), error)
    *rows, last = array.tolist()
    if tuple(last) != _LAST_ROW and any(
        abs(given - wanted) > 1e-9 for given, wanted in zip(last, _LAST_ROW, strict=True)
    ):
        raise error(f"{name} must have the last row (0, 0, 0, 1), got {last}")
    _check_rotation(f"{name}[:3, :3]", [row[:3] for row in rows], error)
    return array


def unit_vector(name: str, value: Any, error: type[ValueError] = PerceptionError) -> FloatArray:
    """Return a read-only (3,) unit vector; a length within 1e-3 of 1 is normalised."""
    array = finite_array(name, value, (3,), error)
    length = math.hypot(*array.tolist())
    if abs(length - 1.0) > 1e-3:
        raise error(f"{name} must be a unit vector, got length {length:g}")
    unit = np.asarray(array / length)
    unit.setflags(write=False)
    return unit


def pixel_count(name: str, value: Any) -> int:
    """Return a width or height: a whole number ≥ 1."""
    number = finite_number(name, value, minimum=1.0)
    if number != int(number):
        raise PerceptionError(f"{name} must be a whole number of pixels, got {number:g}")
    return int(number)


def check_image(image_rgb: Any, height_px: int | str = "H", width_px: int | str = "W") -> None:
    """Raise PerceptionError unless this is a uint8 RGB image; a letter is any extent."""
    wanted = (height_px, width_px, 3)
    if not isinstance(image_rgb, np.ndarray):
        found = type(image_rgb).__name__
    elif image_rgb.dtype != np.uint8 or not _fits(image_rgb.shape, wanted):
        found = f"{image_rgb.dtype} of shape {image_rgb.shape}{_conversion_hint(image_rgb)}"
    else:
        return
    raise PerceptionError(
        f"image_rgb must be uint8 RGB of shape {_shape_text(wanted)}, got {found}"
    )


def _conversion_hint(image: NDArray[Any]) -> str:
    if image.dtype == np.uint8 and image.ndim == 2:
        return "; cv2.cvtColor(image, cv2.COLOR_GRAY2RGB) makes it RGB"
    if image.dtype == np.uint8 and image.ndim == 3 and image.shape[2] == 4:
        return "; drop the fourth channel"
    return ""


def median_of(values: Iterable[float]) -> float:
    """Return the median of a few numbers, at least one; ``np.median`` takes ten times as long."""
    ordered = sorted(values)
    last = len(ordered) - 1
    return 0.5 * (ordered[last // 2] + ordered[(last + 1) // 2])


def given(check: Callable[..., _T], name: str, value: Any, *args: Any, **bounds: Any) -> _T | None:
    """Return None for None, and else what a check of this module returns for the value."""
    return None if value is None else check(name, value, *args, **bounds)


def set_fields(instance: object, **values: Any) -> None:
    """Assign checked values to the fields of a frozen dataclass, in its ``__post_init__``."""
    for field, value in values.items():
        object.__setattr__(instance, field, value)
