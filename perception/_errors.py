"""The error base of the perception package."""

from __future__ import annotations


class PerceptionError(ValueError):
    """Input that perception cannot use; the message says what was given and what is valid."""
