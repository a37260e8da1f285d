"""Base errors of the whole library and of the perception package."""

from __future__ import annotations


class AwarenavError(ValueError):
    """Base of all errors that this library raises deliberately.

    The message says what was given and what is valid. Each package derives its own error:
    :class:`PerceptionError`, ``TrackingError``, ``NavError`` and ``SimError``.
    """


class PerceptionError(AwarenavError):
    """Error for input that perception cannot use."""


class DepthImageError(PerceptionError):
    """Error for a depth image of another size, type, unit or time; the picture may be good."""
