"""Files that grow by whole lines, and what becomes of damaged lines when one is continued."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from .errors import AwarenavError, counted

# Windows opens files as text unless told otherwise; other systems have no such flag.
_BINARY: Final = getattr(os, "O_BINARY", 0)
# Further damaged lines are only counted.
_MOST_NAMED: Final = 5


@dataclass(frozen=True, slots=True)
class DamagedLine:
    """A line of a file that cannot be used.

    Attributes:
        number: of the line, from 1.
        content: the line without its end.
        reason: why it cannot be used.
    """

    number: int
    content: bytes
    reason: str


class LineFile(AbstractContextManager["LineFile"]):
    """A file that lines are appended to, each of them whole or not at all.

    A line is in the file when :meth:`add` returns. When it cannot be written, for example to a full
    disk, the part that was is removed again. A process that is killed meanwhile leaves at most one
    unfinished line at the end, which has no line end.

    Args:
        path: of the file, made when missing.
        error: class of the errors.

    Raises:
        AwarenavError: or ``error``, if the file cannot be opened.
    """

    def __init__(self, path: Path, error: type[AwarenavError] = AwarenavError) -> None:
        self._path = path
        self._error = error
        self._file = -1
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | _BINARY
        try:
            self._file = os.open(path, flags, 0o666)
        except OSError as cause:
            raise error(f"cannot write {path}: {cause.strerror or cause}") from cause

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; every line is already in it."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def add(self, text: str) -> None:
        """Append a text that ends with a line end.

        Raises:
            AwarenavError: or the class given, if it cannot be written; nothing of it is in the file
                then.
        """
        rest = memoryview(text.encode())
        size = os.fstat(self._file).st_size
        try:
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError as cause:
            os.ftruncate(self._file, size)
            raise self._error(
                f"cannot write {self._path}: {cause.strerror or cause}; the lines so far are "
                "kept, and --resume continues"
            ) from cause

    def cut(self, size_bytes: int) -> None:
        """Remove everything after the first ``size_bytes`` of the file.

        Raises:
            AwarenavError: or the class given, if the file cannot be written.
        """
        try:
            os.ftruncate(self._file, size_bytes)
        except OSError as cause:
            raise self._error(f"cannot write {self._path}: {cause.strerror or cause}") from cause


def set_aside(
    path: Path,
    damaged: Sequence[DamagedLine],
    remedy: str,
    error: type[AwarenavError] = AwarenavError,
) -> None:
    """Append damaged lines to the file ``.damaged`` beside theirs, and name them on standard error.

    Args:
        path: the file that they are from; it is not changed.
        damaged: the lines; without any, nothing happens.
        remedy: what becomes of them, the end of the message.
        error: class of the errors.

    Raises:
        AwarenavError: or ``error``, if they cannot be written.
    """
    if not damaged:
        return
    aside = path.with_name(path.name + ".damaged")
    try:
        with aside.open("ab") as file:
            file.writelines(line.content + b"\n" for line in damaged)
            file.flush()
            os.fsync(file.fileno())
    except OSError as cause:
        raise error(f"cannot write {aside}: {cause.strerror or cause}") from cause
    for line in damaged[:_MOST_NAMED]:
        reason = line.reason.removeprefix(f"{path}, line {line.number}").lstrip(": ")
        print(f"{path}, line {line.number} is damaged: {reason}", file=sys.stderr)
    if len(damaged) > _MOST_NAMED:
        more = counted(len(damaged) - _MOST_NAMED, "more line is", "more lines are")
        print(f"{path}: {more} damaged", file=sys.stderr)
    print(f"{counted(len(damaged), 'line')} set aside in {aside}; {remedy}", file=sys.stderr)
