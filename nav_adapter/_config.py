"""The base of all settings of the package."""

from __future__ import annotations

from typing import ClassVar

from tracking.config import StrictConfig

from ._errors import NavError


class NavConfig(StrictConfig):
    """Strict settings whose files are refused with a :class:`NavError`."""

    error: ClassVar[type[ValueError]] = NavError
