"""The errors of the simulation."""

from __future__ import annotations

from awarenav.errors import AwarenavError, MissingExtraError


class SimError(AwarenavError):
    """Input that the simulation cannot use; the message says what was given and what is valid."""


class MissingSimulatorError(SimError, MissingExtraError):
    """PyBullet cannot be imported; the message names the extra that installs it."""
