"""The folder of fetched networks, each held to a known sha256."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path
from typing import Final

from perception.networks import OnnxModel, OnnxSettings

from ..errors import AwarenavError
from ..files import write_text
from ._catalogue import Catalogue, RealModel

#: The environment variable with the folder of fetched networks.
ENVIRONMENT: Final = "AWARENAV_MODELS"

_CHUNK_BYTES: Final = 1 << 20


class ModelStore:
    """Fetched networks in a folder, each held to its sha256.

    It is that of the catalogue. For a network without one there, the first fetch is trusted, and
    its sha256 is kept beside the network, in the format of ``sha256sum``.

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
        expected, found = self.expected_sha256(name), _sha256(path)
        if expected is None:
            raise AwarenavError(
                f"{path} was not put there by awarenav models fetch, and its sha256 is not known; "
                "move it away and fetch it"
            )
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
        return OnnxModel(self.path(name), settings=settings, sha256=self.expected_sha256(name))

    def is_fetched(self, name: str) -> bool:
        """Return whether the file exists; its contents are not checked."""
        return self._file(name).is_file()

    def expected_sha256(self, name: str) -> str | None:
        """Return the sha256 that the file must have.

        None before the first fetch of a network whose sha256 the catalogue does not have.

        Raises:
            AwarenavError: for a record of the first fetch that cannot be read.
        """
        if pinned := self.catalogue[name].sha256:
            return pinned
        record = self._record(name)
        try:
            return record.read_text(encoding="utf-8")[:64] if record.exists() else None
        except (OSError, UnicodeError) as cause:
            raise AwarenavError(f"cannot read {record}: {cause}") from cause

    def fetch(
        self, name: str, *, sha256: str | None = None, progress: bool = True
    ) -> tuple[Path, bool]:
        """Fetch a network, unless it is there and unaltered.

        The file appears when it is complete and verified. An altered file is replaced.

        Args:
            name: of the catalogue.
            sha256: that the ONNX file must have, from a source that the caller trusts.
            progress: shows a progress bar on standard error.

        Returns:
            The path, and whether anything was downloaded.

        Raises:
            AwarenavError: for an unknown name, a folder that cannot be written, a download that
                fails, and a file whose sha256 is not the given one, the catalogue's or that of the
                first fetch; an existing file then stays.
        """
        model, path = self.catalogue[name], self._file(name)
        known = self.expected_sha256(name)
        if sha256 is not None and known is not None and sha256 != known:
            source = "the catalogue" if model.sha256 else "the first fetch"
            raise AwarenavError(f"{name}: --sha256 is {sha256}, {source} says {known}")
        wanted = sha256 or known
        if path.is_file() and wanted is not None and _sha256(path) == wanted:
            return path, False
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=".fetch-", dir=self.folder) as scratch:
                self._download(model, Path(scratch), wanted, progress)
        except OSError as cause:
            raise AwarenavError(
                f"cannot write to {self.folder}: {cause.strerror or cause}"
            ) from cause
        return path, True

    def _download(
        self, model: RealModel, scratch: Path, wanted: str | None, progress: bool
    ) -> None:
        """Download a network, check its sha256 and move it to its place."""
        # Only a fetch needs the modules of a client of the web.
        from ._download import download  # noqa: PLC0415

        fresh = download(model, scratch, progress=progress)
        found = _sha256(fresh)
        if wanted is not None and found != wanted:
            raise AwarenavError(
                f"{model.name}: the file of {model.url} has sha256 {found}, expected {wanted}; it "
                "is not kept"
            )
        if model.sha256 is None:
            write_text(self._record(model.name), f"{found}  {model.file}\n")
        fresh.chmod(0o644)  # a temporary file is its owner's alone; other users may read networks
        fresh.replace(self._file(model.name))

    def _file(self, name: str) -> Path:
        return self.folder / self.catalogue[name].file

    def _record(self, name: str) -> Path:
        """Return the path of the sha256 of a first fetch."""
        return self._file(name).with_suffix(".sha256")


def default_folder() -> Path:
    """Return the folder of fetched networks that the environment asks for."""
    if chosen := os.environ.get(ENVIRONMENT):
        return Path(chosen).expanduser()
    cache = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(cache) if Path(cache).is_absolute() else Path.home() / ".cache"
    return base / "awarenav" / "models"


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    try:
        with path.open("rb") as file:
            while chunk := file.read(_CHUNK_BYTES):
                digest.update(chunk)
    except OSError as cause:
        raise AwarenavError(f"cannot read {path}: {cause.strerror or cause}") from cause
    return digest.hexdigest()
