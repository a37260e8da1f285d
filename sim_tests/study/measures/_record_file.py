"""Tables of episodes on disk: ``episodes.csv``, and the same table as Parquet."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from awarenav.files import atomic_path
from awarenav.line_files import DamagedLine

from ...world.errors import SimError
from ._ranges import check_ranges
from ._record import RECORD_COLUMNS, EpisodeRecord, check_columns, parse_row, record_row

_PARQUET_SUFFIX: Final = ".parquet"


@dataclass(frozen=True, slots=True)
class RecordFile:
    """The content of a table of episodes.

    Attributes:
        records: one per whole row, in the order of the rows.
        torn: text of an unfinished last row, which an interruption leaves; empty without one.
        whole_bytes: length of the file up to the end of its last whole row; to resume a run, cut
            the file there.
    """

    records: tuple[EpisodeRecord, ...]
    torn: str
    whole_bytes: int


@dataclass(frozen=True, slots=True)
class SalvagedFile:
    """The content of a table of episodes that may be damaged.

    Attributes:
        rows: number and content of the line, and the record, of each row that is not damaged.
        damaged: the other lines.
        torn: the file ends without a line end.
        whole_bytes: length of the file up to its last line end.
        appendable: its columns are those of this version, in their order.
    """

    rows: tuple[tuple[int, bytes, EpisodeRecord], ...]
    damaged: tuple[DamagedLine, ...]
    torn: bool
    whole_bytes: int
    appendable: bool


def read_record_file(path: Path | str) -> RecordFile:
    """Read ``episodes.csv``, with or without an unfinished last row.

    A row counts once its line end is written. Columns may come in any order. A column that an
    earlier version did not write takes its default.

    Raises:
        SimError: the file cannot be read, is not a table of episodes, or a whole row is wrong.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as cause:
        raise SimError(f"cannot read the episodes {path}: {cause.strerror or cause}") from cause
    whole_bytes = content.rfind(b"\n") + 1
    torn = content[whole_bytes:].decode("utf-8", errors="replace")
    try:
        text = content[:whole_bytes].decode(
            "utf-8-sig"
        )  # a spreadsheet may have written a byte order mark
        rows = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    except (UnicodeDecodeError, csv.Error) as cause:
        raise SimError(f"{path} is not a table of episodes: {cause}") from cause
    if not rows:
        if torn and not ",".join(RECORD_COLUMNS).startswith(torn):
            raise SimError(f"{path} is not a table of episodes: it has no line end")
        return RecordFile((), torn, 0)
    header, *body = rows
    check_columns(header, str(path))
    records = [
        parse_row(header, cells, f"{path}, line {line}")
        for line, cells in enumerate(body, start=2)
        if cells
    ]
    return RecordFile(tuple(records), torn, whole_bytes)


def salvage_record_file(path: Path) -> SalvagedFile:
    """Read ``episodes.csv`` line by line, leaving out the lines that are damaged.

    A line is damaged if it is not a row, or has a number that no episode can have. A damaged header
    is read as that of this version.

    Raises:
        SimError: the file cannot be read.
    """
    try:
        *lines, torn = path.read_bytes().split(b"\n")
    except OSError as cause:
        raise SimError(f"cannot read the episodes {path}: {cause.strerror or cause}") from cause
    columns: Sequence[str] = RECORD_COLUMNS
    rows, damaged = [], []
    for number, line in enumerate(lines, start=1):
        source = f"{path}, line {number}"
        try:
            cells = next(csv.reader([line.decode("utf-8-sig")], strict=True), [])
            if number == 1:
                check_columns(cells, source)
                columns = cells
            elif cells:
                record = check_ranges(parse_row(columns, cells, source), source)
                rows.append((number, line, record))
        except (UnicodeDecodeError, csv.Error, SimError) as cause:
            damaged.append(DamagedLine(number, line, str(cause)))
    whole_bytes = sum(len(line) + 1 for line in lines)
    appendable = tuple(columns) == tuple(RECORD_COLUMNS)
    return SalvagedFile(tuple(rows), tuple(damaged), bool(torn), whole_bytes, appendable)


def read_records(path: Path | str) -> tuple[EpisodeRecord, ...]:
    """Return the episodes of a CSV file, or of a file with the suffix ``.parquet``.

    An unfinished last row is left out and reported on standard error.

    Raises:
        SimError: as :func:`read_record_file`.
    """
    if Path(path).suffix == _PARQUET_SUFFIX:
        from ._parquet import read_parquet  # noqa: PLC0415 - an optional dependency

        return read_parquet(Path(path))
    found = read_record_file(path)
    if found.torn:
        print(
            f"{path}: the last row is unfinished and left out: {found.torn[:60]!r}",
            file=sys.stderr,
        )
    return found.records


def write_records(path: Path | str, records: Iterable[EpisodeRecord]) -> None:
    """Write episodes as CSV, or as Parquet to a file with the suffix ``.parquet``.

    The file appears whole or not at all.

    Raises:
        SimError: the file cannot be written.
    """
    path = Path(path)
    if path.suffix == _PARQUET_SUFFIX:
        from ._parquet import write_parquet  # noqa: PLC0415 - an optional dependency

        write_parquet(path, tuple(records))
        return
    if not path.parent.is_dir():
        raise SimError(f"cannot write the episodes {path}: there is no folder {path.parent}")
    with atomic_path(path, SimError) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(RECORD_COLUMNS)
        writer.writerows(record_row(record) for record in records)
