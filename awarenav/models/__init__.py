"""The shipped networks and those for a real robot: ``awarenav models``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._store import ModelStore

__all__ = [
    "ModelStore",
]

__getattr__ = lazy_names(__name__, {"._store": ("ModelStore",)})
