"""The shipped networks and those for a real robot: ``awarenav models``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._catalogue import Catalogue, NetworkSet, RealModel
    from ._store import ModelStore, default_folder

__all__ = ["Catalogue", "ModelStore", "NetworkSet", "RealModel", "default_folder"]

__getattr__ = lazy_page(__name__, __file__)
