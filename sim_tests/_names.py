"""What to say about a name that does not exist."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def not_one_of(what: str, given: object, valid: Iterable[str]) -> str:
    """A message that names what was given, what is valid, and the nearest valid name."""
    names = list(valid)
    near = difflib.get_close_matches(str(given), names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    return f"{what} must be one of {', '.join(map(repr, names))}, got {given!r}{hint}"
