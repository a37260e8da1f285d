"""The folder of fetched networks, each held to a known sha256."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Final

from ..errors import AwarenavError
from ..networks import OnnxModel, OnnxSettings
from ._catalogue import Catalogue

#: The environment variable with the folder of fetched networks.
ENVIRONMENT: Final = "AWARENAV_MODELS"
_CHUNK_BYTES: Final = 1 << 20


class NetworkFolder:
    """Fetched networks in a folder, each held to its sha256 in the catalogue.

    Args:
        folder: default ``$AWARENAV_MODELS``, or ``awarenav/models`` in the user's cache folder
            (``$XDG_CACHE_HOME``, or ``~/.cache``). The first fetch makes it.
        catalogue: of the networks that can be fetched; default the package's own.
    """

    def __init__(self, folder: Path | None = None, catalogue: Catalogue | None = None) -> None:
        self.folder = default_folder() if folder is None else folder
        self.catalogue = Catalogue.shipped() if catalogue is None else catalogue

    def path(self, name: str) -> Path:
        """Return the path of a fetched network after checking its sha256.

        Raises:
            AwarenavError: for an unknown name, a network that is not fetched, or an altered file.
        """
        path = self._file(name)
        if not path.is_file():
            raise AwarenavError(f"{name} is not in {self.folder}: awarenav models fetch {name}")
        expected, found = self.catalogue[name].sha256, sha256_of(path)
        if found != expected:
            raise AwarenavError(
                f"{path} has been altered: its sha256 is {found}, expected {expected}; "
                f"awarenav models fetch {name} replaces it"
            )
        return path

    def load(self, name: str, settings: OnnxSettings | None = None) -> OnnxModel:
        """Load a fetched network; the sha256 is checked on the bytes that are loaded.

        Raises:
            AwarenavError: as :meth:`path`.
            PerceptionError: if onnxruntime cannot run the network with these settings.
        """
        return OnnxModel(self.path(name), settings=settings, sha256=self.catalogue[name].sha256)

    def is_fetched(self, name: str) -> bool:
        """Return whether the file exists; its contents are not checked."""
        return self._file(name).is_file()

    def _file(self, name: str) -> Path:
        return self.folder / self.catalogue[name].file


def default_folder() -> Path:
    """Return the folder of fetched networks that the environment asks for."""
    if chosen := os.environ.get(ENVIRONMENT):
        return Path(chosen).expanduser()
    cache = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(cache) if Path(cache).is_absolute() else Path.home() / ".cache"
    return base / "awarenav" / "models"


def sha256_of(path: Path) -> str:
    """Return the sha256 of a file's content.

    Raises:
        AwarenavError: for a file that cannot be read.
    """
    digest = hashlib.sha256()
    try:
        with path.open("rb") as file:
            while chunk := file.read(_CHUNK_BYTES):
                digest.update(chunk)
    except OSError as cause:
        raise AwarenavError(f"cannot read {path}: {cause.strerror or cause}") from cause
    return digest.hexdigest()
