"""The errors of the simulation."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from awarenav.errors import AwarenavError, MissingExtraError
from perception.installation import install_command


class SimError(AwarenavError):
    """An input that the simulation cannot use; the message says what was given and is valid."""


class MissingSimulatorError(SimError, MissingExtraError):
    """PyBullet is not installed; the message names the extra that installs it."""


@contextmanager
def needs(what: str, package: str, error: type[AwarenavError] = SimError) -> Iterator[None]:
    """Turn a missing package of the extra ``bench`` into an error that says what needs it."""
    try:
        yield
    except ImportError as cause:
        raise error(
            f"{what} needs {package}, which is not installed; it is part of the extra 'bench': "
            f"{install_command('bench')}"
        ) from cause
