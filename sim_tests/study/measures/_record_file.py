"""The episodes of a run on disk: ``episodes.csv``, the same table as Parquet, and single files."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

from awarenav.errors import did_you_mean
from awarenav.files import atomic_path
from perception.installation import install_command

from ...world.errors import SimError
from ._record import COLUMNS, Awareness, EpisodeRecord

if TYPE_CHECKING:
    import pyarrow

Kind = Literal["text", "flag", "count", "number"]

#: Decimals of numbers in files: micrometres.
DECIMALS: Final = 6

_KINDS: Final[dict[str, Kind]] = {
    "str": "text",
    "Awareness": "text",
    "bool": "flag",
    "int": "count",
    "float | None": "number",
}
#: Columns of ``episodes.csv`` in their order, and the kind of each.
COLUMN_KINDS: Final[dict[str, Kind]] = {
    name: _KINDS[str(EpisodeRecord.__dataclass_fields__[name].type)] for name in COLUMNS
}
RECORD_COLUMNS: Final = tuple(COLUMN_KINDS)
#: Columns that every table must have; others take their defaults.
REQUIRED_COLUMNS: Final = tuple(
    field.name for field in fields(EpisodeRecord) if field.default is MISSING
)
_PARQUET: Final = ".parquet"


def read_records(path: Path | str) -> tuple[EpisodeRecord, ...]:
    """Return the episodes of a CSV file, or of a file with the suffix ``.parquet``.

    Columns may come in any order. A column that an earlier version did not write takes its default.

    Raises:
        SimError: the file cannot be read, or is not a table of episodes.
    """
    path = Path(path)
    if path.suffix == _PARQUET:
        header, *body = _parquet_rows(path)
    else:
        try:
            # A spreadsheet may have written a byte order mark.
            text = io.StringIO(path.read_bytes().decode("utf-8-sig"), newline="")
            header, *body = list(csv.reader(text, strict=True)) or [[]]
        except OSError as cause:
            raise SimError(f"cannot read the episodes {path}: {cause.strerror or cause}") from cause
        except (UnicodeDecodeError, csv.Error) as cause:
            raise SimError(f"{path} is not a table of episodes: {cause}") from cause
    check_columns(header, str(path))
    return tuple(
        parse_row(header, cells, f"{path}, line {line}")
        for line, cells in enumerate(body, start=2)
        if cells
    )


def write_records(path: Path | str, records: Iterable[EpisodeRecord]) -> None:
    """Write episodes as CSV, or as Parquet to a file with the suffix ``.parquet``.

    The file appears whole or not at all. Parquet has typed columns, and None as null.

    Raises:
        SimError: the file cannot be written, or Parquet without the extra ``bench``.
    """
    path = Path(path)
    if path.suffix == _PARQUET:
        pq = _parquet()
        table = _parquet_table(tuple(records))
        # Given a path, pyarrow takes only names in UTF-8.
        with atomic_path(path, SimError) as part, part.open("wb") as data:
            pq.write_table(table, data)
        return
    if not path.parent.is_dir():
        raise SimError(f"cannot write the episodes {path}: there is no folder {path.parent}")
    with atomic_path(path, SimError) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(RECORD_COLUMNS)
        writer.writerows(record_row(record) for record in records)


def _parquet() -> Any:
    """Return the module that reads and writes Parquet."""
    try:
        import pyarrow.parquet as pq  # noqa: PLC0415 - an optional dependency
    except ImportError as cause:  # pragma: no cover - depends on the installation
        raise SimError(
            "Parquet needs pyarrow, which is not installed; it is part of the extra 'bench': "
            + install_command("bench")
        ) from cause
    return pq


def _parquet_table(records: tuple[EpisodeRecord, ...]) -> pyarrow.Table:
    import pyarrow as pa  # noqa: PLC0415 - an optional dependency

    types = {"text": pa.string(), "flag": pa.bool_(), "count": pa.int64(), "number": pa.float64()}

    def value_of(record: EpisodeRecord, name: str) -> Any:
        value = getattr(record, name)
        if isinstance(value, str):
            return one_line(value)
        return rounded(value) if isinstance(value, float) else value

    columns = {name: [value_of(record, name) for record in records] for name in COLUMN_KINDS}
    schema = pa.schema([(name, types[kind]) for name, kind in COLUMN_KINDS.items()])
    return pa.table(columns, schema=schema)


def _parquet_rows(path: Path) -> list[list[str]]:
    """Return header and rows of a Parquet file as the cells of the CSV file."""
    pq = _parquet()
    try:
        with path.open("rb") as file:
            table = pq.read_table(file)
    except (OSError, ValueError) as cause:  # ArrowInvalid is a ValueError
        raise SimError(f"cannot read the episodes {path}: {cause}") from cause

    def cell(value: Any) -> str:
        if value is None:
            return ""
        return str(value).lower() if isinstance(value, bool) else str(value)

    return [
        list(table.column_names),
        *([cell(v) for v in row.values()] for row in table.to_pylist()),
    ]


def rounded(value: float | None) -> float | None:
    """Return a number as it is read back from a file; None for None, NaN and infinity.

    A record in memory therefore equals the same record read from a file, and a resumed run gives
    the same records as an uninterrupted one.
    """
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DECIMALS}f}") + 0.0  # no negative zero


def record_row(record: EpisodeRecord) -> list[str]:
    """Return the cells of one episode in the order of :data:`RECORD_COLUMNS`.

    Numbers have six decimals, and None is an empty cell. Line breaks in texts become spaces, so
    that an episode is always one line.
    """
    return [_cell_text(kind, getattr(record, name)) for name, kind in COLUMN_KINDS.items()]


def one_line(text: str) -> str:
    """Return a text on one line and without NUL, which the csv module of Python 3.10 refuses."""
    return " ".join(text.replace("\0", "").splitlines())


def check_columns(columns: Sequence[str], source: str) -> None:
    """Check the header of a table of episodes.

    Raises:
        SimError: a column is unknown or there twice, or a required one is missing.
    """
    for name in columns:
        if name not in COLUMN_KINDS:
            hint = did_you_mean(name, RECORD_COLUMNS)
            raise SimError(
                f"{source} is not a table of episodes: unknown column {name[:80]!r}{hint} "
                "(docs/simulation.md lists all)"
            )
        if list(columns).count(name) > 1:
            raise SimError(f"{source} has the column {name!r} {list(columns).count(name)} times")
    missing = [name for name in REQUIRED_COLUMNS if name not in columns]
    if missing:
        raise SimError(f"{source} is not a table of episodes: it has no column {missing[0]!r}")


def parse_row(columns: Sequence[str], cells: Sequence[str], source: str) -> EpisodeRecord:
    """Return the episode of a row.

    Args:
        columns: the header, already checked.
        cells: one text per column.
        source: file and line, for messages.

    Raises:
        SimError: a cell does not fit its column, or there are more or fewer cells than columns.
    """
    if len(cells) != len(columns):
        raise SimError(f"{source} has {len(cells)} cells, its header {len(columns)}")
    values: dict[str, Any] = {
        name: _parse_cell(name, cell, source) for name, cell in zip(columns, cells, strict=True)
    }
    return EpisodeRecord(**values)


def _cell_text(kind: Kind, value: Any) -> str:
    if kind == "number":
        number = rounded(value)
        return "" if number is None else f"{number:.{DECIMALS}f}"
    if kind == "flag":
        return str(bool(value)).lower()
    if kind == "count":
        return str(int(value))
    return one_line(str(value))


def _parse_cell(name: str, cell: str, source: str) -> Any:
    kind = COLUMN_KINDS[name]
    if kind == "flag":
        if cell not in ("true", "false"):
            raise SimError(f"{source}: {name} must be true or false, got {cell[:80]!r}")
        return cell == "true"
    if kind == "text":
        if name == "awareness" and cell not in get_args(Awareness):
            known = ", ".join(map(repr, get_args(Awareness)))
            raise SimError(f"{source}: awareness must be one of {known}, got {cell[:80]!r}")
        return cell
    if kind == "number" and not cell:
        return None
    try:
        number = int(cell) if kind == "count" else float(cell)
    except ValueError as cause:
        what = "a whole number" if kind == "count" else "a number or empty"
        raise SimError(f"{source}: {name} must be {what}, got {cell[:80]!r}") from cause
    if not math.isfinite(number):
        raise SimError(f"{source}: {name} must be finite or empty, got {cell[:80]!r}")
    return number
