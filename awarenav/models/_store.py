"""One file out of a ZIP archive that came from elsewhere.

The folder of fetched networks: what is in it, and that it is what it was.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Final

from perception import PerceptionError

from ..errors import AwarenavError
from ._catalogue import Catalogue, RealModel
from ._download import download

if TYPE_CHECKING:
    from perception.networks import OnnxModel, OnnxSettings

_MAX_BYTES: Final = 2 << 30


def extract_member(archive: Path, member: str, target: Path) -> None:
    """Write one file of a ZIP archive to ``target``, whatever path it has in the archive.

    Nothing is unpacked by its own name, so no entry can land outside ``target``. The archive's own
    checksum (CRC-32) is checked.

    Args:
        archive: the ZIP file.
        member: full path in the archive, or its last parts: ``end2end.onnx`` finds the only entry
            of that name in any folder.
        target: the file to write; the caller moves it to its place once it is verified.

    Raises:
        AwarenavError: for a file that is no ZIP archive or is cut off, and when no entry fits,
            several do, or the entry is damaged or larger than 2 GiB.
    """
    wanted = PurePosixPath(member).parts
    try:
        with zipfile.ZipFile(archive) as opened:
            fitting = [
                entry
                for entry in opened.infolist()
                if not entry.is_dir()
                and PurePosixPath(entry.filename).parts[-len(wanted) :] == wanted
            ]
            if len(fitting) != 1:
                held = ", ".join(opened.namelist()[:12]) or "nothing"
                count = "no entry" if not fitting else f"{len(fitting)} entries"
                raise AwarenavError(f"{archive.name} has {count} called {member}; it holds {held}")
            (entry,) = fitting
            if entry.file_size > _MAX_BYTES:
                raise AwarenavError(
                    f"{entry.filename} in {archive.name} would be {entry.file_size / 1e9:.1f} GB, "
                    f"at most {_MAX_BYTES / 1e9:.1f} GB are unpacked"
                )
            with opened.open(entry) as source, target.open("wb") as file:
                shutil.copyfileobj(source, file, 1 << 20)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as cause:
        raise AwarenavError(f"{archive.name} is no whole ZIP archive: {cause}") from cause
    except OSError as cause:
        raise AwarenavError(f"cannot unpack {archive.name}: {cause.strerror or cause}") from cause


ENVIRONMENT: Final = "AWARENAV_MODELS"

_LOCK_FILE: Final = "models.lock.json"
_CHUNK_BYTES: Final = 1 << 20


@dataclass(frozen=True, slots=True)
class LockedModel:
    """What was fetched, as the folder's lock file keeps it.

    Attributes:
        sha256: of the ONNX file.
        size_bytes: of the ONNX file.
        url: where it came from.
        pinned: whether its sha256 was known beforehand; otherwise the first download was trusted.
    """

    sha256: str
    size_bytes: int
    url: str
    pinned: bool


class ModelStore:
    """Fetched networks in a folder, each held to the sha256 that the catalogue or the lock says.

    Args:
        folder: default ``$AWARENAV_MODELS``, or ``awarenav/models`` in the user's cache folder
            (``$XDG_CACHE_HOME``, or ``~/.cache``). It is made when something is fetched.
        catalogue: of what can be fetched; default the package's own.
    """

    def __init__(self, folder: Path | None = None, catalogue: Catalogue | None = None) -> None:
        self.folder = default_folder() if folder is None else folder
        self.catalogue = Catalogue.shipped() if catalogue is None else catalogue

    def path(self, name: str) -> Path:
        """Return the path of a fetched network after checking that it is unaltered.

        Raises:
            AwarenavError: for an unknown name, one that has not been fetched, or an altered file.
        """
        model = self.catalogue[name]
        path = self.folder / model.file
        if not path.is_file():
            raise AwarenavError(f"{name} is not in {self.folder}: awarenav models fetch {name}")
        self._check(model, path)
        return path

    def load(self, name: str, settings: OnnxSettings | None = None) -> OnnxModel:
        """Load a fetched network, its sha256 checked on the very bytes that are loaded.

        Raises:
            AwarenavError: as :meth:`path`.
            PerceptionError: when onnxruntime cannot run it as the settings ask.
        """
        from perception.networks import OnnxModel  # noqa: PLC0415

        return OnnxModel(self.path(name), settings=settings, sha256=self.expected_sha256(name))

    def is_fetched(self, name: str) -> bool:
        """Whether the file is there; it may have been altered since."""
        return (self.folder / self.catalogue[name].file).is_file()

    def expected_sha256(self, name: str) -> str | None:
        """The sha256 that the file is held to; None before the first fetch of an unpinned one."""
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
        """Fetch a network unless it is there and unaltered.

        The file appears when it is whole and verified. An altered file is replaced.

        Args:
            name: of the catalogue.
            sha256: that the ONNX file must have, from a source that the caller trusts.
            progress: a bar on stderr.
            pause_s: before a second attempt at a broken download.

        Returns:
            The path, and whether anything was downloaded.

        Raises:
            AwarenavError: for an unknown name, a download that fails, a file of another sha256 than
                the given, the catalogue's or the lock's (what is there then stays), or one that an
                unpinned address gave and that is no network.
        """
        model = self.catalogue[name]
        self._make_folder()
        with self._alone(model):
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
                self._get(model, fresh, progress, pause_s)
                found = _sha256(fresh)
                if wanted is not None and found != wanted:
                    raise AwarenavError(
                        f"{name}: what {model.url} gave has sha256 {found}, expected {wanted}; "
                        "it was thrown away"
                    )
                if wanted is None:
                    _require_network(fresh, model)
                size_bytes = fresh.stat().st_size
                fresh.replace(path)
            finally:
                fresh.unlink(missing_ok=True)
            entry = LockedModel(found, size_bytes, model.url, pinned=wanted is not None)
            self._lock(name, entry)
        return path, True

    def locked(self) -> dict[str, LockedModel]:
        """Return what the folder's lock file says was fetched.

        Raises:
            AwarenavError: for a lock file that is none; what was fetched can then not be trusted.
        """
        path = self.folder / _LOCK_FILE
        try:
            entries = json.loads(path.read_text(encoding="utf-8"))["models"]
            return {name: LockedModel(**entry) for name, entry in entries.items()}
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as cause:
            raise AwarenavError(
                f"{path} cannot be read ({cause}): it says what was fetched; remove it and the "
                "networks beside it to start anew"
            ) from cause

    def _check(self, model: RealModel, path: Path) -> None:
        expected = self.expected_sha256(model.name)
        if expected is None:
            raise AwarenavError(
                f"{path} was not put there by awarenav models fetch, and no sha256 of it is known; "
                "move it away and fetch it"
            )
        found = _sha256(path)
        if found != expected:
            raise AwarenavError(
                f"{path} has been altered: its sha256 is {found}, expected {expected}; "
                f"awarenav models fetch {model.name} replaces it"
            )

    def _get(self, model: RealModel, fresh: Path, progress: bool, pause_s: float) -> None:
        """Download to ``fresh``, through the archive where there is one."""
        if model.member is None:
            download(model.url, fresh, pause_s=pause_s, progress=progress)
            return
        archive = fresh.with_name(model.name + ".zip")
        try:
            download(model.url, archive, pause_s=pause_s, progress=progress)
            extract_member(archive, model.member, fresh)
        finally:
            archive.unlink(missing_ok=True)

    def _make_folder(self) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as cause:
            raise AwarenavError(f"cannot make {self.folder}: {cause.strerror or cause}") from cause

    @contextlib.contextmanager
    def _alone(self, model: RealModel) -> Iterator[None]:
        """Hold the folder against a second fetch of the same network."""
        try:
            gate = (self.folder / f".{model.name}.lock").open("w")
        except OSError as cause:
            raise AwarenavError(
                f"cannot write to {self.folder}: {cause.strerror or cause}"
            ) from cause
        with gate:
            try:
                fcntl.flock(gate, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise AwarenavError(
                    f"{model.name} is being fetched to {self.folder} already"
                ) from None
            yield

    def _lock(self, name: str, entry: LockedModel) -> None:
        with (self.folder / ".lock").open("w") as gate:
            fcntl.flock(gate, fcntl.LOCK_EX)  # two fetches of two networks may end at once
            entries = self.locked() | {name: entry}
            text = json.dumps({"models": {key: asdict(value) for key, value in entries.items()}})
            partial = self.folder / f"{_LOCK_FILE}.part"
            partial.write_text(text + "\n", encoding="utf-8")
            partial.replace(self.folder / _LOCK_FILE)


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
    # A proxy's login page must not become the file that later downloads are held to.
    from perception.networks import OnnxModel  # noqa: PLC0415

    try:
        OnnxModel(path)
    except PerceptionError as cause:
        raise AwarenavError(
            f"{model.name}: what {model.url} gave is no network: {cause}"
        ) from cause
