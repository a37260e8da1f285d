"""The errors of the simulation."""

from __future__ import annotations

from awarenav.errors import AwarenavError, MissingExtraError


class SimError(AwarenavError):
    """An input that the simulation cannot use; the message says what was given and is valid."""


class MissingSimulatorError(SimError, MissingExtraError):
    """PyBullet is not installed; the message names the extra that installs it."""
