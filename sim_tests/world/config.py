"""The base of all settings of the simulation."""

from __future__ import annotations

from typing import ClassVar

from tracking.config import StrictConfig

from .errors import SimError


class SimConfig(StrictConfig):
    """Strict settings whose files are refused with a :class:`SimError`."""

    error: ClassVar[type[ValueError]] = SimError
