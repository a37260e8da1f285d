"""The error base of the tracking package."""

from __future__ import annotations

from perception.errors import AwarenavError


class TrackingError(AwarenavError):
    """Input that tracking cannot use; the message says what was given and what is valid."""
