"""Errors of the tools, and messages about names that do not exist."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from perception.errors import AwarenavError

__all__ = [
    "AwarenavError",
    "MissingExtraError",
    "not_one_of",
]


class MissingExtraError(AwarenavError, ImportError):
    """An optional dependency cannot be imported; the message names the extra that installs it."""


def not_one_of(what: str, given: object, valid: Iterable[str]) -> str:
    """Return a message that names what was given, what is valid, and the nearest valid name."""
    names = list(valid)
    near = difflib.get_close_matches(str(given), names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    return f"{what} must be one of {', '.join(map(repr, names))}, got {given!r}{hint}"
