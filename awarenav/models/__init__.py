"""The shipped networks and those for a real robot: ``awarenav models``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lazy import lazy_names

if TYPE_CHECKING:
    from ._archive import extract_member
    from ._catalogue import Catalogue, NetworkSet, RealModel
    from ._download import BrokenDownloadError, download
    from ._store import LockedModel, ModelStore, default_folder

__all__ = [
    "BrokenDownloadError",
    "Catalogue",
    "LockedModel",
    "ModelStore",
    "NetworkSet",
    "RealModel",
    "default_folder",
    "download",
    "extract_member",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._archive": ("extract_member",),
        "._catalogue": ("Catalogue", "NetworkSet", "RealModel"),
        "._download": ("BrokenDownloadError", "download"),
        "._store": ("LockedModel", "ModelStore", "default_folder"),
    },
)
