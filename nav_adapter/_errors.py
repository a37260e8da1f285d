"""The error base of the nav_adapter package."""

from __future__ import annotations

from perception.errors import AwarenavError


class NavError(AwarenavError):
    """Input that navigation cannot use; the message says what was given and what is valid."""
