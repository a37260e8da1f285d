"""Errors of the tools, and functions that word messages."""

from __future__ import annotations

from perception.errors import AwarenavError, did_you_mean, nearest_file, not_one_of

__all__ = [
    "AwarenavError",
    "MissingExtraError",
    "counted",
    "did_you_mean",
    "nearest_file",
    "not_one_of",
]


class MissingExtraError(AwarenavError, ImportError):
    """An optional dependency cannot be imported; the message names the extra that installs it."""


def counted(number: int, name: str, plural: str | None = None) -> str:
    """Return a number and a noun, in the plural if need be: "1 frame", "2 frames"."""
    return f"{number} {name}" if number == 1 else f"{number} {plural or name + 's'}"
