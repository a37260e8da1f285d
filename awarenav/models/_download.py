"""Downloads of networks from their publishers' addresses, by pooch and requests."""

from __future__ import annotations

import re
import shutil
import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import Final
from urllib.parse import urlsplit

import pooch
import requests

from ..errors import AwarenavError
from ._catalogue import RealModel

_TIMEOUT_S: Final = 30.0
# Attempts after the first, for a connection that breaks.
_RETRIES: Final = 2


def download(model: RealModel, folder: Path, *, progress: bool = True) -> Path:
    """Download a network into a folder, and unpack it if it comes in an archive.

    Proxies and certificates are those of requests (``HTTPS_PROXY``, ``REQUESTS_CA_BUNDLE``).

    Args:
        model: the network; the caller checks the sha256 of the file.
        folder: exists, and holds nothing else.
        progress: shows a progress bar on standard error.

    Returns:
        The path of the ONNX file.

    Raises:
        AwarenavError: for a connection that cannot be made or breaks, a server that does not have
            the file, and an archive that is damaged or does not hold the network.
        OSError: for a folder that cannot be written.
    """
    pooch.get_logger().setLevel("WARNING")
    name = model.file if model.member is None else f"{model.name}.zip"
    source = pooch.create(
        path=folder,
        base_url="",
        registry={name: None},
        urls={name: model.url},
        retry_if_failed=_RETRIES,
    )
    get = pooch.HTTPDownloader(progressbar=progress, timeout=_TIMEOUT_S)
    try:
        path = Path(source.fetch(name, downloader=get))
    except requests.HTTPError as cause:
        raise AwarenavError(f"{model.name}: the server answers {cause}") from cause
    except requests.RequestException as cause:
        # The rest of the text names objects of the libraries.
        told = re.search(r"\[Errno -?\d+\] [\w ]+", str(cause))
        raise AwarenavError(
            f"no connection to {urlsplit(model.url).hostname} "
            f"({told[0] if told else type(cause).__name__}); run it again, or "
            "fetch on another computer and copy the folder. Without it, ONNX files of your own "
            "and, in the simulator, the shipped networks work"
        ) from cause
    return path if model.member is None else _unpacked(path, model.member, folder / model.file)


def _unpacked(archive: Path, member: str, target: Path) -> Path:
    """Write the one file of a ZIP archive whose path ends in ``member``; return its path.

    Names in the archive never become paths, so nothing can be written elsewhere.
    """
    wanted = PurePosixPath(member).parts
    try:
        with zipfile.ZipFile(archive) as opened:
            names = [name for name in opened.namelist() if not name.endswith("/")]
            fitting = [
                name for name in names if PurePosixPath(name).parts[-len(wanted) :] == wanted
            ]
            if len(fitting) != 1:
                held = ", ".join(names[:12]) or "nothing"
                raise AwarenavError(
                    f"{archive.name} has {len(fitting)} entries called {member}; it holds {held}"
                )
            with opened.open(fitting[0]) as source, target.open("wb") as file:
                shutil.copyfileobj(source, file)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as cause:
        raise AwarenavError(f"{archive.name} is not a complete ZIP archive: {cause}") from cause
    return target
