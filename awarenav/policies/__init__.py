"""Radius, human speed and speed limit of policies: ``awarenav policy``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._show import read_policy

__all__ = ["read_policy"]

__getattr__ = lazy_page(__name__, __file__)
