"""Tables of recorded positions of people, as others write them: read, checked and cut in parts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from awarenav.tracks import read_people_table
from perception.arrays import FloatArray
from tracking.units import FASTEST_MPS

from ...world.errors import SimError

_HEADINGS: Final = {"heading_rad": 1.0, "heading_deg": math.pi / 180.0}
#: A longer time without a row is no gap to fill: the person was away.
LONGEST_GAP_S: Final = 0.5
# Nobody is recorded on a larger floor.
_LARGEST_FLOOR_M: Final = 300.0
# A row this many usual steps after the one before it ends a gap.
_GAP_STEPS: Final = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class RecordedTrack:
    """The rows of one person without a long gap.

    Attributes:
        id: ``id`` in the table.
        name: the id, followed by the number of the part from the second on.
        times_s: (N,) increasing, N ≥ 2.
        positions_odom_m: (N, 2).
        headings_odom_rad: (N,) unwrapped; None without the column.
    """

    id: str
    name: str
    times_s: FloatArray
    positions_odom_m: FloatArray
    headings_odom_rad: FloatArray | None


@dataclass(frozen=True, slots=True)
class RecordedTable:
    """The tracks of a table, and what was done to get them.

    Attributes:
        tracks: in order of the first rows.
        filled_gaps: gaps of at most 0.5 s, which are interpolated.
        long_gaps: longer gaps, at which a person leaves and comes back.
        lone_rows: rows on their own between two long gaps, left out.
        ignored: columns that are not read.
    """

    tracks: tuple[RecordedTrack, ...]
    filled_gaps: int
    long_gaps: int
    lone_rows: int
    ignored: tuple[str, ...]

    def of(self, name: str) -> tuple[RecordedTrack, ...]:
        """Return the parts of one id."""
        return tuple(track for track in self.tracks if track.id == name)


def read_table(path: Path | str) -> RecordedTable:
    """Read a table with the columns ``t_s``, ``id``, ``x_m`` and ``y_m``.

    ``heading_rad`` or ``heading_deg`` is read where it is given; other columns are ignored. The
    rows of each id are in order of time.

    Raises:
        SimError: naming file and line, for a missing column, a value that is not a finite number,
            time that goes back or stands still, an id with one row, a person who moves faster than
            12 m/s, and a floor of more than 300 m, as units other than metres give.
    """
    path = Path(path)
    rows, ignored, heading = _read_rows(path)
    tracks: list[RecordedTrack] = []
    filled = long_gaps = lone = 0
    for name, numbered in rows.items():
        lines = np.array([line for line, _ in numbered])
        values = np.array([row for _, row in numbered])
        if len(values) < 2:
            raise SimError(
                f"{path}, line {lines[0]}: {name!r} has one row; a recorded path needs two or more"
            )
        steps_s = np.diff(values[:, 0])
        _check_order(path, name, lines, values, steps_s)
        gaps = steps_s > LONGEST_GAP_S
        _check_speeds(path, name, lines, values, steps_s, gaps)
        usual_s = float(np.median(steps_s))
        filled += int(((steps_s > _GAP_STEPS * usual_s) & ~gaps).sum())
        long_gaps += int(gaps.sum())
        parts = [part for part in np.split(values, np.flatnonzero(gaps) + 1) if len(part) > 1]
        lone += len(values) - sum(map(len, parts))
        if not parts:
            raise SimError(
                f"{path}: the rows of {name!r} are {usual_s:g} s apart; gaps of at most "
                f"{LONGEST_GAP_S:g} s can be filled. t_s is in seconds"
            )
        for number, part in enumerate(parts):
            own = name if number == 0 else f"{name} ({number + 1})"
            turned = None if heading is None else np.unwrap(heading * part[:, 3])
            tracks.append(RecordedTrack(name, own, part[:, 0], part[:, 1:3], turned))
    _check_floor(path, tracks)
    return RecordedTable(tuple(tracks), filled, long_gaps, lone, ignored)


def _read_rows(
    path: Path,
) -> tuple[dict[str, list[tuple[int, list[float]]]], tuple[str, ...], float | None]:
    """Return (line, numbers) by id, the columns that are not read, and the unit of headings."""
    table = read_people_table(path, tuple(_HEADINGS), SimError)
    heading = next((name for name in _HEADINGS if name in table.rows[0].more), None)
    rows: dict[str, list[tuple[int, list[float]]]] = {}
    for row in table.rows:
        numbers = [row.t_s, row.x_m, row.y_m]
        if heading is not None:
            angle = row.more[heading]
            if angle is None:
                raise SimError(f"{path}, line {row.line}: {heading} is empty; fill it in all rows")
            numbers.append(angle)
        rows.setdefault(row.id, []).append((row.line, numbers))
    return rows, table.ignored, None if heading is None else _HEADINGS[heading]


def _check_order(
    path: Path, name: str, lines: FloatArray, values: FloatArray, steps_s: FloatArray
) -> None:
    wrong = np.flatnonzero(steps_s <= 0.0)
    if len(wrong):
        row = int(wrong[0])
        before_s, after_s = values[row, 0], values[row + 1, 0]
        what = (
            f"has two rows for t_s = {after_s:g} s"
            if before_s == after_s
            else f"goes back in time, from {before_s:g} to {after_s:g} s"
        )
        raise SimError(f"{path}, line {lines[row + 1]}: {name!r} {what}")


def _check_speeds(
    path: Path,
    name: str,
    lines: FloatArray,
    values: FloatArray,
    steps_s: FloatArray,
    gaps: NDArray[np.bool_],
) -> None:
    moved_m = np.linalg.norm(np.diff(values[:, 1:3], axis=0), axis=1)
    wrong = np.flatnonzero((moved_m > FASTEST_MPS * steps_s) & ~gaps)
    if len(wrong):
        row = int(wrong[0])
        raise SimError(
            f"{path}, line {lines[row + 1]}: {name!r} moves {moved_m[row]:.3g} m in "
            f"{steps_s[row]:.3g} s, faster than {FASTEST_MPS:g} m/s; t_s is in seconds, x_m and "
            f"y_m are in metres"
        )


def _check_floor(path: Path, tracks: list[RecordedTrack]) -> None:
    places = np.vstack([track.positions_odom_m for track in tracks])
    size_m = float(np.ptp(places, axis=0).max())
    if size_m > _LARGEST_FLOOR_M:
        raise SimError(
            f"{path}: the people are spread over {size_m:.4g} m, more than {_LARGEST_FLOOR_M:g} m; "
            "x_m and y_m are in metres, these look like millimetres"
        )
