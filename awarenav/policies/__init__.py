"""Radius, assumed human speed and speed limit of policies: ``awarenav policy``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lazy import lazy_names

if TYPE_CHECKING:
    from ._explore import explorer_page
    from ._show import read_policy

__all__ = [
    "explorer_page",
    "read_policy",
]

__getattr__ = lazy_names(__name__, {"._explore": ("explorer_page",), "._show": ("read_policy",)})
