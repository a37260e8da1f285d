"""The shipped networks and those for a real robot: ``awarenav models``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._store import ModelStore

__all__ = ["ModelStore"]

__getattr__ = lazy_page(__name__, __file__)
