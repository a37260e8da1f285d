"""The error bases: of the whole library, and of the perception package."""

from __future__ import annotations


class AwarenavError(ValueError):
    """Base of every error that this library raises on purpose.

    The message says what was given and what is valid. Each package derives its own:
    :class:`PerceptionError`, ``TrackingError``, ``NavError`` and ``SimError``.
    """


class PerceptionError(AwarenavError):
    """Input that perception cannot use; the message says what was given and what is valid."""
