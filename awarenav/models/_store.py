"""The folder of fetched networks, each held to a known sha256."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import filelock

from perception import PerceptionError
from perception.documents import read_json
from perception.networks import OnnxModel, OnnxSettings

from ..errors import AwarenavError
from ..files import write_text
from ._archive import extract_member
from ._catalogue import Catalogue, RealModel
from ._download import download

#: The environment variable with the folder of fetched networks.
ENVIRONMENT: Final = "AWARENAV_MODELS"

_LOCK_FILE: Final = "models.lock.json"
_CHUNK_BYTES: Final = 1 << 20


@dataclass(frozen=True, slots=True)
class LockedModel:
    """A fetched network, as the folder's lock file keeps it.

    Attributes:
        sha256: of the ONNX file.
        size_bytes: of the ONNX file.
        url: where it came from.
        pinned: whether its sha256 was known before the first download, which was trusted otherwise.
    """

    sha256: str
    size_bytes: int
    url: str
    pinned: bool


class ModelStore:
    """Fetched networks in a folder, each held to the sha256 of the catalogue or the lock file.

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
        model = self.catalogue[name]
        path = self.folder / model.file
        if not path.is_file():
            raise AwarenavError(f"{name} is not in {self.folder}: awarenav models fetch {name}")
        self._check_sha256(model, path)
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
        return (self.folder / self.catalogue[name].file).is_file()

    def expected_sha256(self, name: str) -> str | None:
        """Return the sha256 that the file must have.

        None before the first fetch of a network whose sha256 the catalogue does not have.
        """
        locked = self.locked().get(name)
        return self.catalogue[name].sha256 or (None if locked is None else locked.sha256)

    def fetch(
        self,
        name: str,
        *,
        sha256: str | None = None,
        progress: bool = True,
        pause_s: float = 1.0,
    ) -> tuple[Path, bool]:
        """Fetch a network, unless it is there and unaltered.

        The file appears when it is complete and verified. An altered file is replaced.

        Args:
            name: of the catalogue.
            sha256: that the ONNX file must have, from a source that the caller trusts.
            progress: shows a progress bar on standard error.
            pause_s: pause before the second attempt at a broken download, seconds.

        Returns:
            The path, and whether anything was downloaded.

        Raises:
            AwarenavError: for an unknown name; a download that fails; a file whose sha256 is not
                the given one, the catalogue's or the lock file's (an existing file then stays); and
                a first download that is not a network.
        """
        model = self.catalogue[name]
        self._make_folder()
        with self._fetch_lock(model):
            known = self.expected_sha256(name)
            if sha256 is not None and known is not None and sha256 != known:
                source = "the catalogue" if model.sha256 else "the first fetch"
                raise AwarenavError(f"{name}: --sha256 is {sha256}, {source} says {known}")
            wanted = sha256 or known
            path = self.folder / model.file
            if path.is_file() and wanted is not None and _sha256(path) == wanted:
                return path, False
            fresh = path.with_name(path.name + ".new")
            try:
                self._download(model, fresh, progress, pause_s)
                found = _sha256(fresh)
                if wanted is not None and found != wanted:
                    raise AwarenavError(
                        f"{name}: the file of {model.url} has sha256 {found}, expected {wanted}; "
                        "it is not kept"
                    )
                if wanted is None:
                    _require_network(fresh, model)
                size_bytes = fresh.stat().st_size
                fresh.replace(path)
            finally:
                fresh.unlink(missing_ok=True)
            self._add_to_lock_file(
                name, LockedModel(found, size_bytes, model.url, pinned=wanted is not None)
            )
        return path, True

    def locked(self) -> dict[str, LockedModel]:
        """Return the contents of the folder's lock file: the fetched networks by name.

        Raises:
            AwarenavError: for a lock file that cannot be read; the networks cannot be verified
                without it.
        """
        path = self.folder / _LOCK_FILE
        try:
            if not path.exists():
                return {}
            entries = read_json(path, AwarenavError)["models"]
            return {name: LockedModel(**entry) for name, entry in entries.items()}
        except (ValueError, KeyError, TypeError, AttributeError) as cause:
            raise AwarenavError(
                f"{path} cannot be read ({cause}): it has the sha256 of each fetched network; "
                "remove it and the networks beside it, and fetch them again"
            ) from cause

    def _check_sha256(self, model: RealModel, path: Path) -> None:
        expected = self.expected_sha256(model.name)
        if expected is None:
            raise AwarenavError(
                f"{path} was not put there by awarenav models fetch, and its sha256 is not known; "
                "move it away and fetch it"
            )
        found = _sha256(path)
        if found != expected:
            raise AwarenavError(
                f"{path} has been altered: its sha256 is {found}, expected {expected}; "
                f"awarenav models fetch {model.name} replaces it"
            )

    def _download(self, model: RealModel, fresh: Path, progress: bool, pause_s: float) -> None:
        """Download the ONNX file to ``fresh``, from its archive if it comes in one."""
        # The size in the catalogue is approximate, and an archive holds more than the network.
        max_bytes = int(1e6 * (2.0 * model.size_mb + 64.0))

        def fetch_to(path: Path) -> None:
            download(model.url, path, pause_s=pause_s, max_bytes=max_bytes, progress=progress)

        if model.member is None:
            fetch_to(fresh)
            return
        archive = fresh.with_name(model.name + ".zip")
        try:
            fetch_to(archive)
            extract_member(archive, model.member, fresh)
        finally:
            archive.unlink(missing_ok=True)

    def _make_folder(self) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as cause:
            raise AwarenavError(f"cannot make {self.folder}: {cause.strerror or cause}") from cause

    @contextmanager
    def _fetch_lock(self, model: RealModel) -> Iterator[None]:
        """Refuse a second fetch of the same network into the folder at the same time."""
        lock = filelock.FileLock(self.folder / f".{model.name}.lock")
        try:
            lock.acquire(timeout=0)
        except filelock.Timeout:
            raise AwarenavError(f"{model.name} is being fetched to {self.folder} already") from None
        except OSError as cause:
            raise AwarenavError(
                f"cannot write to {self.folder}: {cause.strerror or cause}"
            ) from cause
        try:
            yield
        finally:
            lock.release()

    def _add_to_lock_file(self, name: str, entry: LockedModel) -> None:
        # Fetches of two networks may end at the same time.
        with filelock.FileLock(self.folder / ".lock"):
            entries = self.locked() | {name: entry}
            text = json.dumps({"models": {key: asdict(value) for key, value in entries.items()}})
            write_text(self.folder / _LOCK_FILE, text + "\n")


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


def _require_network(path: Path, model: RealModel) -> None:
    """Refuse a file that is not a network, such as the login page of a proxy."""
    try:
        OnnxModel(path)
    except PerceptionError as cause:
        raise AwarenavError(
            f"{model.name}: the file of {model.url} is not a network: {cause}"
        ) from cause
