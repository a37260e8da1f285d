"""A CSV of people's positions as a recording: ``t_s, id, x_m, y_m``, and ``std_m`` if known."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from perception import PersonObservation
from perception.arrays import finite_number

from ..errors import AwarenavError
from ._recording import ASSUMED_POSITION_STD_M, RecordedFrame, Recording

_COLUMNS: Final = ("t_s", "id", "x_m", "y_m")
_STD: Final = "std_m"
# Observations need a sensor's frame: this one looks straight down from above the people. Its x is
# odom's x, its y is against odom's y.
_ABOVE_M: Final = 8.0
_CHEST_M: Final = 1.2
_T_ODOM_ABOVE: Final = np.array(
    [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, _ABOVE_M],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


class _Row(NamedTuple):
    stamp_s: float
    id: int
    x_m: float
    y_m: float
    std_m: float | None


def is_positions(path: Path) -> bool:
    """Return whether a file holds positions, by its suffix."""
    return path.suffix.lower() == ".csv"


def read_positions(path: Path) -> Recording:
    """Read a CSV of positions on the floor, in metres of any fixed frame.

    Rows of the same time are one frame.

    Raises:
        AwarenavError: for a file that cannot be read, without the columns, or with a value that is
            not valid; the message names the line.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = sorted(_rows(path, csv.DictReader(file)), key=itemgetter(0))
    except (OSError, UnicodeDecodeError, csv.Error) as cause:
        raise AwarenavError(f"cannot read {path}: {cause}") from cause
    frames = [
        _frame(stamp_s, list(group)) for stamp_s, group in itertools.groupby(rows, itemgetter(0))
    ]
    assumed = sum(row.std_m is None for row in rows)
    return Recording(path, tuple(frames), (), assumed, has_camera=False)


def _rows(path: Path, reader: csv.DictReader[str]) -> Iterator[_Row]:
    names = reader.fieldnames or ()
    missing = [name for name in _COLUMNS if name not in names]
    if missing:
        raise AwarenavError(
            f"{path} must have the columns {', '.join(_COLUMNS)} and may have {_STD}; "
            f"it lacks {', '.join(missing)}"
        )
    for row in reader:
        where = f"{path}, line {reader.line_num}"
        try:
            person = int(row["id"])
        except (TypeError, ValueError):
            raise AwarenavError(f"{where}: id must be a whole number, got {row['id']!r}") from None
        std_m = None
        if row.get(_STD):
            std_m = _number(where, row, _STD)
            if std_m <= 0.0:
                raise AwarenavError(f"{where}: {_STD} must be above 0 m, got {std_m:g}")
        numbers = [_number(where, row, name) for name in ("t_s", "x_m", "y_m")]
        yield _Row(numbers[0], person, numbers[1], numbers[2], std_m)


def _number(where: str, row: dict[str, str], name: str) -> float:
    try:
        value = float(row[name])
    except (TypeError, ValueError):
        raise AwarenavError(f"{where}: {name} must be a number, got {row[name]!r}") from None
    return finite_number(f"{where}: {name}", value, AwarenavError)


def _frame(stamp_s: float, rows: list[_Row]) -> RecordedFrame:
    observations = tuple(
        PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=np.array([row.x_m, -row.y_m, _ABOVE_M - _CHEST_M]),
            position_covariance_m2=(row.std_m or ASSUMED_POSITION_STD_M) ** 2 * np.eye(3),
            gaze_camera=None,
            awareness=None,
            awareness_std=None,
            score=1.0,
        )
        for row in rows
    )
    return RecordedFrame(
        name=f"{stamp_s:g} s",
        stamp_s=stamp_s,
        T_odom_camera=_T_ODOM_ABOVE,
        observations=observations,
        ids=tuple(row.id for row in rows),
        tracks=None,
    )
