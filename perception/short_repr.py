"""A ``repr`` that fits on a screen, for dataclasses that hold much."""

from __future__ import annotations

from collections.abc import Sequence, Sized
from dataclasses import fields, is_dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

# Longer values are described instead of printed. Tuples of a few results may be longer.
_VALUE_CHARACTERS: Final = 80
_TUPLE_CHARACTERS: Final = 300
_ARRAY_CELLS: Final = 6


def short_repr(instance: Any, *figures: str) -> str:
    """Return ``Name(field=value, …)`` of a dataclass, with long values described.

    Numbers have six digits. A long collection is its length and the type of its items, e.g.
    ``<273 CrossingFrame>``, and a long array its shape. Assign it in the class body:
    ``__repr__ = short_repr``, under ``@dataclass(repr=False)``.

    Args:
        instance: of the dataclass.
        figures: names of properties that are shown after the fields.
    """
    names = [*(field.name for field in fields(instance) if field.repr), *figures]
    cells = (f"{name}={_short(getattr(instance, name))}" for name in names)
    return f"{type(instance).__name__}({', '.join(cells)})"


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, np.ndarray):
        return _array_text(value)
    if isinstance(value, tuple):
        text = ", ".join(_item(item) for item in value[:_TUPLE_CHARACTERS])
        text = f"({text},)" if len(value) == 1 else f"({text})"
        return text if len(text) <= _TUPLE_CHARACTERS else _described(value)
    text = repr(value)
    if len(text) <= _VALUE_CHARACTERS:
        return text
    return _described(value)


def _array_text(array: NDArray[Any]) -> str:
    if array.size > _ARRAY_CELLS:
        return f"<array {array.shape}>"
    return f"[{', '.join(map(_short, array.ravel().tolist()))}]"


def _item(item: Any) -> str:
    return repr(item) if is_dataclass(item) else _short(item)


def _described(value: Any) -> str:
    """Return the beginning of a text, the length of a collection, or the type of an object."""
    if isinstance(value, str):
        return f"{value[: _VALUE_CHARACTERS - 3]!r}…"
    if isinstance(value, Sequence):
        return f"<{len(value)} {type(value[0]).__name__}>"
    if isinstance(value, Sized):
        return f"<{type(value).__name__} of {len(value)}>"
    return f"<{type(value).__name__}>"
