"""The base of all settings of the simulation, and seeds."""

from __future__ import annotations

from typing import Any, ClassVar

from perception.arrays import finite_number
from tracking.config import StrictConfig

from .errors import SimError


class SimConfig(StrictConfig):
    """Strict settings whose files are refused with a :class:`SimError`."""

    error: ClassVar[type[ValueError]] = SimError


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
