"""The shipped networks and those for a real robot: ``awarenav models``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._catalogue import DEFAULT_SET, RealModel
    from ._store import ModelStore

__all__ = ["DEFAULT_SET", "ModelStore", "RealModel"]

__getattr__ = lazy_page(__name__, __file__)
