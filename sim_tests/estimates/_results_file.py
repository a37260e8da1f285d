"""The growing JSON Lines file of estimates."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from .._closing import Closing
from .._errors import SimError
from ..sets._frame_records import Record, read_records, record_line, write_records


def settings_mark(settings: Mapping[str, object]) -> str:
    """Eight hexadecimal digits that differ for different settings."""
    text = repr(sorted((name, str(value)) for name, value in settings.items()))
    return hashlib.sha256(text.encode()).hexdigest()[:8]


class ResultsFile(Closing):
    """Appends a line a frame, on the disk as soon as it is whole.

    Args:
        path: of the file.
        mark: of the settings, which every line carries.
        resume: continues a file made with the same settings; its frames are in ``done``.
        overwrite: replaces a file that is there.

    Raises:
        SimError: for a file that is there and may not be replaced or cannot be continued.
    """

    def __init__(
        self, path: Path, mark: str, *, resume: bool = False, overwrite: bool = False
    ) -> None:
        self.done: frozenset[str] = frozenset()
        exists = path.exists()
        if path.is_dir():
            raise SimError(f"--out must be a file, {path} is a folder")
        if exists and not resume and not overwrite:
            raise SimError(f"{path} exists already: --resume continues it, --overwrite replaces it")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if exists and resume:
                records = read_records(path)
                _same_settings(path, records, mark)
                write_records(path, records)  # without a line that was cut off
                self.done = frozenset(str(record["frame"]) for record in records)
            self._file = path.open("a" if resume else "w", encoding="utf-8")
        except OSError as cause:
            raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause

    def add(self, record: Record) -> None:
        """Append one frame."""
        self._file.write(record_line(record))
        self._file.flush()

    def close(self) -> None:
        """Close the file; what was added is in it already."""
        self._file.close()


def _same_settings(path: Path, records: list[Record], mark: str) -> None:
    others = {str(record.get("settings")) for record in records} - {mark}
    if others:
        raise SimError(
            f"{path} was made with other settings (mark {', '.join(sorted(others))}, these have "
            f"{mark}); use the same ones to continue it, --overwrite, or another file"
        )
