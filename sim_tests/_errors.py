"""The errors of the sim_tests package."""

from __future__ import annotations


class SimError(ValueError):
    """Input that the simulation cannot use; the message says what was given and what is valid."""


class MissingSimulatorError(SimError, ImportError):
    """PyBullet cannot be imported; the message names the extra that installs it."""
