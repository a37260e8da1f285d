"""The error base of the nav_adapter package."""

from __future__ import annotations


class NavError(ValueError):
    """Input that the adapter cannot use; the message says what was given and what is valid."""
