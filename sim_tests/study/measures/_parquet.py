"""The one place that imports pyarrow: episodes as a Parquet file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from ...world.errors import SimError
from ._record import COLUMN_KINDS, EpisodeRecord, check_columns, parse_row, plain_text, rounded

try:
    import pyarrow as pa
    import pyarrow.parquet as pq
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "Parquet needs pyarrow, which is not installed; it is part of the extra 'bench': "
        "pip install 'awarenav[bench]'"
    ) from cause

_TYPES: Final = {
    "text": pa.string(),
    "flag": pa.bool_(),
    "count": pa.int64(),
    "number": pa.float64(),
}
_SCHEMA: Final = pa.schema([(name, _TYPES[kind]) for name, kind in COLUMN_KINDS.items()])


def write_parquet(path: Path, records: tuple[EpisodeRecord, ...]) -> None:
    """Write episodes, typed, nulls where nothing applies; the file appears whole or not at all.

    Raises:
        SimError: the file cannot be written.
    """
    columns = {name: [_plain(getattr(record, name)) for record in records] for name in COLUMN_KINDS}
    partial = path.with_name(path.name + ".part")
    try:
        pq.write_table(pa.table(columns, schema=_SCHEMA), partial)
        partial.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write the episodes {path}: {cause}") from cause


def read_parquet(path: Path) -> tuple[EpisodeRecord, ...]:
    """Read what :func:`write_parquet` wrote.

    Raises:
        SimError: the file cannot be read or is no table of episodes.
    """
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as cause:
        raise SimError(f"cannot read the episodes {path}: {cause}") from cause
    names = tuple(table.column_names)
    check_columns(names, str(path))
    return tuple(
        parse_row(names, [_text(row[name]) for name in names], f"{path}, row {number}")
        for number, row in enumerate(table.to_pylist(), start=1)
    )


def _plain(value: Any) -> Any:
    if isinstance(value, str):
        return plain_text(value)
    return rounded(value) if isinstance(value, float) else value


def _text(value: Any) -> str:
    """A cell as the CSV file has it, so that both formats pass the same checks."""
    if value is None:
        return ""
    return str(value).lower() if isinstance(value, bool) else str(value)
