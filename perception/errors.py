"""Base errors of the whole library and of the perception package."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path


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


def nearest_file(path: Path) -> str:
    """Return a hint at the file in the folder whose name, without its ending, is most similar."""
    try:
        names = {each.stem: each.name for each in path.parent.iterdir() if each.name != path.name}
    except OSError:
        return ""
    near = difflib.get_close_matches(path.stem, names, n=1, cutoff=0.75)
    return f"; did you mean {names[near[0]]!r}?" if near and not path.exists() else ""


def not_one_of(
    what: str, given: object, valid: Iterable[str], *, or_else: str = "", listed_by: str = ""
) -> str:
    """Return the message that a name is not valid: the nearest valid one first, then all of them.

    Args:
        what: kind of the name, such as ``"scenario"``.
        given: what was given instead.
        valid: valid names.
        or_else: what else is valid, such as ``"a YAML file"``.
        listed_by: command that lists the names, where they are too many for a message.
    """
    names = list(valid)
    hint = did_you_mean(given, names)
    if listed_by:
        return f"{what} {given!r} is unknown{hint or ';'} `{listed_by}` lists all {len(names)}"
    listed = f"must be one of {', '.join(map(repr, names))}{or_else and f', or {or_else}'}"
    if hint:
        return f"{what} {given!r} is unknown{hint} It {listed}"
    return f"{what} {listed}, got {given!r}"
