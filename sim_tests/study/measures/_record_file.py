"""The episodes of a run on disk: ``episodes.csv``, the same table as Parquet, and single files."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from awarenav.files import atomic_path
from perception.documents import read_json
from perception.installation import install_command

from ...world.errors import SimError
from ._record import (
    COLUMN_KINDS,
    RECORD_COLUMNS,
    EpisodeRecord,
    check_columns,
    one_line,
    parse_row,
    record_row,
    rounded,
)

if TYPE_CHECKING:
    import pyarrow

_PARQUET: Final = ".parquet"


def read_rows(folder: Path | str) -> tuple[EpisodeRecord, ...]:
    """Return the episodes of a run that have ended, in the order of its jobs.

    Args:
        folder: of a run, finished or not; or a table of episodes, CSV or Parquet.

    Raises:
        SimError: there is no run, or a file that is not of one; the message names it.
    """
    path = Path(folder)
    if not path.is_dir():
        return read_records(path)
    table, ended = path / "episodes.csv", sorted((path / "episodes").glob("*.json"))
    if ended and not _is_complete(path / "run.json"):  # a killed run has no table, or an old one
        return tuple(_read_episode(each) for each in ended)
    if not table.is_file():
        raise SimError(
            f"{path} holds no {table.name}; give the folder that `awarenav crossings --out DIR` "
            "wrote"
        )
    return read_records(table)


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


def _is_complete(path: Path) -> bool:
    """Return True if a ``run.json`` says that every episode of its run has ended."""
    try:
        about = read_json(path, SimError)
    except SimError:
        return False
    return isinstance(about, dict) and about.get("state") == "complete"


def _read_episode(path: Path) -> EpisodeRecord:
    try:
        return EpisodeRecord(**read_json(path, SimError)["record"])
    except (TypeError, KeyError) as cause:
        raise SimError(f"{path} is not the file of an episode: {cause}") from cause


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
