"""Files that appear whole or not at all, and the numbers in text files."""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Final

from .errors import AwarenavError

# Formats of plots.
_PLOTS: Final = (".png", ".svg", ".pdf")


def check_output(
    out: Path, suffixes: Sequence[str], inputs: Iterable[Path | None] = (), *, option: str = "--out"
) -> None:
    """Refuse a file of results before any work.

    Args:
        out: the file.
        suffixes: one of which it must have; empty for any.
        inputs: files that it must not replace; None for one that was not given.
        option: of the command, for the message.

    Raises:
        AwarenavError: for another suffix, an input, or a folder.
    """
    if suffixes and out.suffix.lower() not in suffixes:
        raise AwarenavError(f"{option} must end in {' or '.join(suffixes)}, got {out}")
    # Not Path.resolve: a link that leads to itself is told by whoever reads it.
    if os.path.realpath(out) in {os.path.realpath(path) for path in inputs if path is not None}:
        raise AwarenavError(f"{option} {out} would replace an input")
    if out.is_dir():
        raise AwarenavError(f"{option} must be a file, {out} is a folder")


def require_writable(folder: Path, error: type[AwarenavError] = AwarenavError) -> None:
    """Make a folder of results, and refuse one that cannot be written, before any work.

    Raises:
        AwarenavError: or ``error``, for a folder that cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=folder):
            pass
    except OSError as cause:
        raise error(f"cannot write to {folder}: {cause.strerror or cause}") from cause


def check_plot(out: Path | None, inputs: Iterable[Path | None]) -> None:
    """Refuse the file of a plot as :func:`check_output` does; None is no plot.

    Raises:
        AwarenavError: as there.
    """
    if out is None:
        return
    if out.suffix.lower() not in _PLOTS:
        raise AwarenavError(f"--out must end in {', '.join(_PLOTS)} or be none, got {out}")
    check_output(out, (), inputs)


@contextmanager
def atomic_path(path: Path, error: type[AwarenavError] = AwarenavError) -> Iterator[Path]:
    """Yield a path to write to; the file there replaces ``path`` when the block ends well.

    The file lies beside ``path`` and is removed when the block fails. Missing folders are made.

    Raises:
        AwarenavError: or ``error``, for a place that cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        part.replace(path)
    except OSError as cause:
        raise error(f"cannot write {path}: {cause.strerror or cause}") from cause
    finally:
        with suppress(NotADirectoryError):  # a parent is a file, so there is nothing to remove
            part.unlink(missing_ok=True)


def write_text(path: Path, text: str, error: type[AwarenavError] = AwarenavError) -> None:
    """Write a UTF-8 file as :func:`atomic_path` does.

    What is no text, as in a file name that is not UTF-8, is written as an escape.

    Raises:
        AwarenavError: or ``error``, for a place that cannot be written.
    """
    with atomic_path(path, error) as part:
        part.write_text(text, encoding="utf-8", errors="backslashreplace")


def write_csv(
    path: Path,
    header: Sequence[str],
    rows: Iterable[Sequence[object]],
    error: type[AwarenavError] = AwarenavError,
) -> None:
    """Write a CSV file as :func:`write_text` does, with Unix line ends.

    Raises:
        AwarenavError: or ``error``, for a place that cannot be written.
    """
    with (
        atomic_path(path, error) as part,
        part.open("w", newline="", encoding="utf-8", errors="backslashreplace") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as Markdown; a bar within a cell is escaped."""
    body = ([cell.replace("|", r"\|") for cell in row] for row in rows)
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, ["---"] * len(header), *body))


def printable(name: str) -> str:
    """Return a text with ? for each byte of a file name that is not UTF-8."""
    return name.encode("utf-8", "replace").decode("utf-8")


def json_text(value: Any) -> str:
    """Return a value as indented JSON with a newline at the end; null for NaN and infinities."""
    return json.dumps(_finite(value), indent=2, ensure_ascii=False) + "\n"


def _finite(value: Any) -> Any:
    """Return the value with None in place of numbers that are not finite."""
    if isinstance(value, Mapping):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def csv_number(value: float | None) -> str:
    """Return a number with six decimals; empty for None, NaN and infinities."""
    return "" if value is None or not math.isfinite(value) else f"{value:.6f}"
