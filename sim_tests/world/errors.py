"""The errors of the simulation."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from awarenav.errors import AwarenavError, MissingExtraError
from perception.arrays import finite_number
from perception.installation import install_command


class SimError(AwarenavError):
    """An input that the simulation cannot use; the message says what was given and is valid."""


class MissingSimulatorError(SimError, MissingExtraError):
    """PyBullet is not installed; the message names the extra that installs it."""


def checked_seed(seed: Any) -> int:
    """Return the seed of an episode as an int.

    Raises:
        SimError: for anything but a whole number that is 0 or more.
    """
    number = finite_number("seed", seed, SimError)
    if number < 0.0:
        raise SimError(f"seed must be 0 or more, got {seed}")
    if not number.is_integer():
        raise SimError(f"seed must be a whole number, got {seed!r}")
    return int(seed)


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
