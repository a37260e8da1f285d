"""A table of recorded people as CSV, the one reader of `tracks` and `scenario from-recording`."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from ..errors import AwarenavError
from ._units import refuse_other_units

_REQUIRED: Final = ("t_s", "id", "x_m", "y_m")
# A whole number as pandas writes it in a column with gaps.
_WHOLE: Final = re.compile(r"(-?[0-9]+)\.0*")


class PersonRow(NamedTuple):
    """A row: where a person was.

    Attributes:
        line: of the file.
        id: of the person, any text.
        t_s: time.
        x_m: place on the floor.
        y_m: place on the floor.
        more: the optional columns that the table has, by name; None where the row has none.
    """

    line: int
    id: str
    t_s: float
    x_m: float
    y_m: float
    more: dict[str, float | None]


class PeopleTable(NamedTuple):
    """The rows of a table in their order, and the columns that are not read."""

    rows: tuple[PersonRow, ...]
    ignored: tuple[str, ...]


def read_people_table(
    path: Path, optional: Sequence[str] = (), error: type[AwarenavError] = AwarenavError
) -> PeopleTable:
    """Read a CSV with the columns ``t_s``, ``id``, ``x_m`` and ``y_m``, in any order.

    A mark of the byte order, the line ``sep=,`` of a spreadsheet, and spaces around values are left
    out. An id is any text; ``1.0`` is 1. A ``.tsv`` has tabs in place of commas.

    Args:
        path: of the file, UTF-8.
        optional: further columns of numbers that are read if the table has them.
        error: class of the errors.

    Raises:
        AwarenavError: or ``error``, naming file and line: the file cannot be read, lacks a column
            or has it twice, has a value that is not valid, or is in other units than seconds and
            metres.
    """
    rows = []
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            comma = "\t" if path.suffix.lower() == ".tsv" else ","
            start = file.tell()
            if file.readline().strip().strip('"') != f"sep={comma}":
                file.seek(start)
            reader = csv.DictReader(file, skipinitialspace=comma == ",", delimiter=comma)
            names = [name.strip() for name in reader.fieldnames or ()]
            _check_header(path, names, optional, error)
            reader.fieldnames = names
            columns = [name for name in names if name in optional]
            for row in reader:
                where = f"{path}, line {reader.line_num}"
                if any(text.strip() for text in row.get(None, ())):  # 0,5 for 0.5
                    raise error(
                        f"{where}: more values than the header's {len(names)}; numbers have a "
                        "decimal point, and a text with a comma is quoted"
                    )
                id = person_id(row["id"] or "")
                if not id:
                    raise error(f"{where}: id is empty")
                t_s, x_m, y_m = (_number(where, row, name, error) for name in ("t_s", "x_m", "y_m"))
                more = {
                    name: _number(where, row, name, error) if (row[name] or "").strip() else None
                    for name in columns
                }
                rows.append(PersonRow(reader.line_num, id, t_s, x_m, y_m, more))
    except UnicodeDecodeError as cause:
        raise error(f"cannot read {path}: it must be UTF-8, {cause}") from cause
    except (OSError, csv.Error) as cause:
        raise error(f"cannot read {path}: {getattr(cause, 'strerror', None) or cause}") from cause
    if not rows:
        raise error(f"{path} holds no rows below its header {', '.join(names)}")
    _check_units(path, rows, error)
    ignored = tuple(name for name in names if name not in (*_REQUIRED, *columns))
    return PeopleTable(tuple(rows), ignored)


def person_id(text: str) -> str:
    """Return an id as it counts: without spaces around it, and ``1`` for ``1.0``."""
    text = text.strip()
    whole = _WHOLE.fullmatch(text)
    return whole[1] if whole else text


def _check_header(
    path: Path, names: list[str], optional: Sequence[str], error: type[AwarenavError]
) -> None:
    missing = [name for name in _REQUIRED if name not in names]
    twice = sorted({name for name in (*_REQUIRED, *optional) if names.count(name) > 1})
    if not missing and not twice:
        return
    own, words = ("\t", "tabs") if path.suffix.lower() == ".tsv" else (",", "commas")
    other = [mark for mark in (";", "\t", ",") if mark != own and mark in "".join(names)]
    raise error(
        f"{path}: the header {'misses' if missing else 'has twice'} {', '.join(missing or twice)}; "
        f"it must name {', '.join(_REQUIRED)} and may name {' or '.join(optional)}, got "
        f"{', '.join(names) or 'nothing'}"
        + (f"; columns are separated by {words}, these by {other[0]!r}" if other else "")
    )


def _number(where: str, row: dict[str, str], column: str, error: type[AwarenavError]) -> float:
    text = row[column]
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:  # Python reads 1_0 as 10
        raise error(f"{where}: {column} must be a finite number, got {text!r}")
    return value


def _check_units(path: Path, rows: list[PersonRow], error: type[AwarenavError]) -> None:
    people: dict[str, list[tuple[float, float, float]]] = {}
    for row in rows:
        people.setdefault(row.id, []).append((row.t_s, row.x_m, row.y_m))
    tables = [np.array(sorted(own)) for own in people.values()]
    refuse_other_units(str(path), ((table[:, 0], table[:, 1:]) for table in tables), error)
