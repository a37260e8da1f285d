"""A file of a downloaded ZIP archive."""

from __future__ import annotations

import shutil
import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import Final

from ..errors import AwarenavError

_MAX_BYTES: Final = 2 << 30
_CHUNK_BYTES: Final = 1 << 20


def extract_member(archive: Path, member: str, target: Path) -> None:
    """Write one file of a ZIP archive to ``target``, whatever its path in the archive is.

    Names in the archive never become paths, so nothing can be written outside ``target``. The
    archive's checksum of the file (CRC-32) is checked.

    Args:
        archive: the ZIP file.
        member: full path in the archive, or its last parts: ``end2end.onnx`` is the only file of
            that name in any folder.
        target: the file to write; the caller verifies it and moves it to its place.

    Raises:
        AwarenavError: for a file that is not a complete ZIP archive, and if none or several of its
            files fit, or the file is damaged or larger than 2 GiB.
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
                    f"{entry.filename} in {archive.name} has {entry.file_size / 1e9:.1f} GB; at "
                    f"most {_MAX_BYTES / 1e9:.1f} GB are unpacked"
                )
            with opened.open(entry) as source, target.open("wb") as file:
                shutil.copyfileobj(source, file, _CHUNK_BYTES)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as cause:
        raise AwarenavError(f"{archive.name} is not a complete ZIP archive: {cause}") from cause
    except OSError as cause:
        raise AwarenavError(f"cannot unpack {archive.name}: {cause.strerror or cause}") from cause
