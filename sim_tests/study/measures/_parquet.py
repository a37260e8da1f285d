"""Tables of episodes as Parquet files; the only module that imports pyarrow."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from awarenav.files import atomic_path
from perception.installation import install_command

from ...world.errors import SimError
from ._record import COLUMN_KINDS, EpisodeRecord, check_columns, one_line, parse_row, rounded

try:
    import pyarrow as pa
    import pyarrow.parquet as pq
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "Parquet needs pyarrow, which is not installed; it is part of the extra 'bench': "
        + install_command("bench")
    ) from cause

_TYPES: Final = {
    "text": pa.string(),
    "flag": pa.bool_(),
    "count": pa.int64(),
    "number": pa.float64(),
}
_SCHEMA: Final = pa.schema([(name, _TYPES[kind]) for name, kind in COLUMN_KINDS.items()])


def write_parquet(path: Path, records: tuple[EpisodeRecord, ...]) -> None:
    """Write episodes with typed columns, None as null; the file appears whole or not at all.

    Raises:
        SimError: the file cannot be written.
    """
    columns = {
        name: [_parquet_value(getattr(record, name)) for record in records] for name in COLUMN_KINDS
    }
    # Given a path, pyarrow takes only names in UTF-8.
    with atomic_path(path, SimError) as part, part.open("wb") as file:
        pq.write_table(pa.table(columns, schema=_SCHEMA), file)


def read_parquet(path: Path) -> tuple[EpisodeRecord, ...]:
    """Read episodes that :func:`write_parquet` wrote.

    Raises:
        SimError: the file cannot be read or is not a table of episodes.
    """
    try:
        with path.open("rb") as file:
            table = pq.read_table(file)
    except (OSError, pa.ArrowException) as cause:
        raise SimError(f"cannot read the episodes {path}: {cause}") from cause
    names = tuple(table.column_names)
    check_columns(names, str(path))
    return tuple(
        parse_row(names, [_csv_cell(row[name]) for name in names], f"{path}, row {number}")
        for number, row in enumerate(table.to_pylist(), start=1)
    )


def _parquet_value(value: Any) -> Any:
    if isinstance(value, str):
        return one_line(value)
    return rounded(value) if isinstance(value, float) else value


def _csv_cell(value: Any) -> str:
    """Return a value as a cell of the CSV file, so that both formats pass the same checks."""
    if value is None:
        return ""
    return str(value).lower() if isinstance(value, bool) else str(value)
