"""NumPy arrays and torch tensors behind the same few operations."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from perception.arrays import finite_array

from .._errors import NavError

# Roots are taken of at least this, so that their gradients are finite.
TINY = 1e-18


@dataclass(frozen=True, slots=True)
class ArrayLibrary:
    """The operations that the speed field needs, of NumPy or of torch.

    Attributes:
        is_torch: whether gradients are wanted, and all poses are computed at once.
        convert: numbers as an array of the type that the field computes with.
        sqrt: of numbers of at least :data:`TINY`; smaller ones count as that.
        root: square root of numbers above 0.
        where: the choice between two arrays, or numbers.
        maximum: of two arrays.
        minimum: of two arrays.
        at_least: the maximum of an array and a number.
        lowest: the minimum over the first axis.
        signbit: whether numbers are negative, −0 included.
        cos: of angles in radians.
        sin: of angles in radians.
        rounding: relative rounding error of a number.
    """

    is_torch: bool
    convert: Callable[[Any], Any]
    sqrt: Callable[[Any], Any]
    root: Callable[[Any], Any]
    where: Callable[[Any, Any, Any], Any]
    maximum: Callable[[Any, Any], Any]
    minimum: Callable[[Any, Any], Any]
    at_least: Callable[[Any, float], Any]
    lowest: Callable[[Any], Any]
    signbit: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    sin: Callable[[Any], Any]
    rounding: float


_NUMPY = ArrayLibrary(
    is_torch=False,
    # Single precision takes half the time. Its rounding error is taken off the gaps.
    convert=lambda values: np.asarray(values, dtype=np.float32),
    sqrt=lambda values: np.sqrt(np.maximum(values, np.float32(TINY))),
    root=np.sqrt,
    where=np.where,
    maximum=np.maximum,
    minimum=np.minimum,
    at_least=np.maximum,
    lowest=lambda values: values.min(axis=0),
    signbit=np.signbit,
    cos=np.cos,
    sin=np.sin,
    rounding=float(np.finfo(np.float32).eps),
)


def is_tensor(values: Any) -> bool:
    """Return whether values are a torch tensor, without importing torch."""
    torch = sys.modules.get("torch")
    return torch is not None and isinstance(values, torch.Tensor)


def library_of(values: Any) -> ArrayLibrary:
    """Return the operations for a torch tensor, or those of NumPy for everything else."""
    if not is_tensor(values):
        return _NUMPY
    torch: Any = sys.modules["torch"]
    return ArrayLibrary(
        is_torch=True,
        convert=lambda given: torch.as_tensor(given, dtype=values.dtype, device=values.device),
        sqrt=lambda given: torch.sqrt(torch.clamp(given, min=TINY)),
        root=torch.sqrt,
        where=torch.where,
        maximum=torch.maximum,
        minimum=torch.minimum,
        at_least=lambda given, least: torch.clamp(given, min=least),
        lowest=lambda given: torch.amin(given, dim=0),
        signbit=torch.signbit,
        cos=torch.cos,
        sin=torch.sin,
        rounding=float(torch.finfo(values.dtype).eps),
    )


def checked(name: str, values: Any, shape: tuple[int | str, ...], like: Any) -> Any:
    """Return a tensor as it is, or other numbers as a NumPy array, after a check.

    Args:
        name: of the argument.
        values: numbers of this shape; a tensor where ``like`` is one.
        shape: sizes, and names of sizes that are free.
        like: the positions.

    Raises:
        NavError: for a wrong shape or type, or a number that is not finite.
    """
    if not is_tensor(like):
        return finite_array(name, values, shape, NavError)
    torch: Any = sys.modules["torch"]
    if not is_tensor(values):
        values = torch.as_tensor(
            finite_array(name, values, shape, NavError), dtype=like.dtype, device=like.device
        )
    if not values.dtype.is_floating_point:
        raise NavError(f"{name} must be a tensor of floats, got {values.dtype}")
    given = tuple(values.shape)
    fits = len(given) == len(shape) and all(
        isinstance(size, str) or size == found for size, found in zip(shape, given, strict=True)
    )
    if not fits:
        raise NavError(f"{name} must have the shape {shape}, got {given}")
    if not bool(torch.isfinite(values).all()):
        raise NavError(f"{name} must be finite")
    return values
