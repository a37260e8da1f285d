"""One file out of a ZIP archive that came from elsewhere."""

from __future__ import annotations

import shutil
import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import Final

from .._errors import SimError

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
        SimError: for a file that is no ZIP archive or is cut off, and when no entry fits, several
            do, or the entry is damaged or larger than 2 GiB.
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
                raise SimError(f"{archive.name} has {count} called {member}; it holds {held}")
            (entry,) = fitting
            if entry.file_size > _MAX_BYTES:
                raise SimError(
                    f"{entry.filename} in {archive.name} would be {entry.file_size / 1e9:.1f} GB, "
                    f"at most {_MAX_BYTES / 1e9:.1f} GB are unpacked"
                )
            with opened.open(entry) as source, target.open("wb") as file:
                shutil.copyfileobj(source, file, 1 << 20)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as cause:
        raise SimError(f"{archive.name} is no whole ZIP archive: {cause}") from cause
    except OSError as cause:
        raise SimError(f"cannot unpack {archive.name}: {cause.strerror or cause}") from cause
