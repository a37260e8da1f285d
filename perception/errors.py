"""Base errors of the whole library and of the perception package."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class AwarenavError(ValueError):
    """Base of all errors that this library raises deliberately.

    The message says what was given and what is valid. Each package derives its own error:
    :class:`PerceptionError`, ``TrackingError``, ``NavError`` and ``SimError``.
    """


class PerceptionError(AwarenavError):
    """Error for input that perception cannot use."""


class DepthImageError(PerceptionError):
    """Error for a depth image of another size, type, unit or time; the picture may be good."""


def did_you_mean(given: object, names: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return a hint at the nearest of some names, ``; did you mean 'x'?``; empty if none is near.

    Args:
        given: what was given instead.
        names: valid ones.
        cutoff: least similarity, from 0 to 1.
    """
    near = difflib.get_close_matches(str(given), list(names), n=1, cutoff=cutoff)
    return f"; did you mean {near[0]!r}?" if near else ""


def not_one_of(what: str, given: object, valid: Iterable[str]) -> str:
    """Return the message that a name is not valid, with the valid names and the nearest one."""
    names = list(valid)
    hint = did_you_mean(given, names)
    return f"{what} must be one of {', '.join(map(repr, names))}, got {given!r}{hint}"
