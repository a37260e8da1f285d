"""Errors of the tools, and functions that word messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from perception.errors import AwarenavError

__all__ = [
    "AwarenavError",
    "MissingExtraError",
    "counted",
    "not_one_of",
]


class MissingExtraError(AwarenavError, ImportError):
    """An optional dependency cannot be imported; the message names the extra that installs it."""


def not_one_of(what: str, given: object, valid: Iterable[str]) -> str:
    """Return the message that a name is not valid, with the valid names and the nearest one."""
    names = list(valid)
    near = difflib.get_close_matches(str(given), names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    return f"{what} must be one of {', '.join(map(repr, names))}, got {given!r}{hint}"


def counted(number: int, name: str, plural: str | None = None) -> str:
    """Return a number and a noun, in the plural if need be: "1 frame", "2 frames"."""
    return f"{number} {name}" if number == 1 else f"{number} {plural or name + 's'}"
