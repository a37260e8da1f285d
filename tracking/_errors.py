"""The error base of the tracking package."""

from __future__ import annotations


class TrackingError(ValueError):
    """Input that the tracker cannot use; the message says what was given and what is valid."""
