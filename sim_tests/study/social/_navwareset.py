"""Episodes as tracks with the columns of NavWareSet (repository ``anr-navware/NavWareSet-Quant``).

Two layouts are read: a row for each person and time (``timestamp, x, y, column, robot_x, robot_y,
robot_yaw_rad``), and a row for each time with ``x1, y1, x2, y2, …``. The first is written.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from awarenav.files import write_text
from perception.arrays import FloatArray

from ...world.errors import SimError
from ._episode import SocialEpisode, headings_of, velocities, wrapped

_ROBOT: Final = ("robot_x", "robot_y", "robot_yaw_rad")
_LONG: Final = ("timestamp", "x", "y", "column", *_ROBOT)
_WIDE: Final = ("timestamp", *_ROBOT)
#: Without a radius in the file: the text of NavWareSet takes 0.4 m for both bodies together.
_ROBOT_RADIUS_M: Final = 0.2
_PERSON_RADIUS_M: Final = 0.2
# Largest file that is read.
_MAX_BYTES: Final = 64 << 20


class _Row(NamedTuple):
    """A row with its line number; ``person`` is None where the columns x1, y1, … hold people."""

    line: int
    stamp_ns: float
    robot: tuple[float, float, float | None]
    people: dict[int, tuple[float, float]]


def write_navwareset(path: Path, episode: SocialEpisode) -> None:
    """Write an episode as a track; times are nanoseconds from its start.

    Without people it has the second layout, with no columns of people.

    Raises:
        SimError: the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_LONG if episode.people else _WIDE)
    for row, t_s in enumerate(episode.t_s.tolist()):
        stamp_ns = round(t_s * 1e9)
        x, y = episode.robot_m[row].tolist()
        robot = [_cell(x), _cell(y), _cell(float(episode.robot_heading_rad[row]))]
        if not episode.people:
            writer.writerow([stamp_ns, *robot])
        for person in np.flatnonzero(episode.present[row]):
            where = [_cell(each) for each in episode.people_m[row, person].tolist()]
            writer.writerow([stamp_ns, *where, int(person) + 1, *robot])
    write_text(path, text.getvalue(), SimError)


def check_navwareset(path: Path) -> list[str]:
    """Return what is wrong with a track, one sentence for each cell; empty if nothing is.

    Raises:
        SimError: the file cannot be read.
    """
    return _parsed(path)[1]


def read_navwareset(path: Path) -> SocialEpisode:
    """Return the episode of a track; its goal and success are not known.

    Velocities come from the positions, and the headings of people from their motion. Without a
    column ``robot_yaw_rad``, so does the heading of the robot.

    Raises:
        SimError: the file cannot be read or does not have these columns.
    """
    rows, found = _parsed(path)
    if found:
        raise SimError(f"{path} is not a NavWareSet track: {found[0]}")
    stamps = sorted({row.stamp_ns for row in rows})
    number = {stamp: index for index, stamp in enumerate(stamps)}
    names = sorted({name for row in rows for name in row.people})
    robot = np.zeros((len(stamps), 3))
    people = np.full((len(stamps), len(names), 2), np.nan)
    for row in rows:
        index = number[row.stamp_ns]
        robot[index] = [math.nan if each is None else each for each in row.robot]
        for name, where in row.people.items():
            people[index, names.index(name)] = where
    t_s = np.array([1e-9 * (stamp - stamps[0]) for stamp in stamps])
    robot_mps, people_mps = velocities(t_s, robot[:, :2]), velocities(t_s, people)
    heading = headings_of(robot_mps) if np.isnan(robot[:, 2]).any() else robot[:, 2]
    return SocialEpisode(
        t_s=t_s,
        robot_m=robot[:, :2],
        robot_heading_rad=heading,
        robot_mps=robot_mps,
        yaw_rate_radps=_rates(t_s, heading),
        people_m=people,
        people_heading_rad=np.where(np.isnan(people[..., 0]), np.nan, headings_of(people_mps)),
        people_mps=people_mps,
        robot_size_m=(2.0 * _ROBOT_RADIUS_M, 2.0 * _ROBOT_RADIUS_M),
        robot_radius_m=_ROBOT_RADIUS_M,
        person_radius_m=_PERSON_RADIUS_M,
        name=path.stem,
    )


def _cell(value: float) -> str:
    """Return a number that is read back to the bit."""
    return repr(value)


def _rates(t_s: FloatArray, heading_rad: FloatArray) -> FloatArray:
    if len(t_s) < 2:
        return np.zeros(len(t_s))
    rates = wrapped(np.diff(heading_rad)) / np.diff(t_s)
    return np.concatenate([rates[:1], rates])


def _parsed(path: Path) -> tuple[list[_Row], list[str]]:
    """Return the rows of a track, and what is wrong with it."""
    header, lines = _table(path)
    found = list(_header_problems(header))
    if found:
        return [], found
    rows: list[_Row] = []
    for line, cells in lines:
        if len(cells) != len(header):
            found.append(f"line {line} has {len(cells)} cells, the header {len(header)}")
            continue
        values: dict[str, float] = {}
        for name, cell in zip(header, cells, strict=True):
            value = _number(cell)
            empty = not cell.strip() or cell.strip().lower() == "nan"
            if value is None and not (empty and re.fullmatch(r"[xy]\d+", name)):
                found.append(f"line {line}: {name} must be a number, got {cell[:60]!r}")
            values[name] = math.nan if value is None else value
        if not found:
            rows.append(_row_of(line, header, values))
    if not found:
        found += _row_problems(rows)
    return rows, found


def _table(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Return the header and the numbered rows of a CSV file."""
    try:
        with path.open("rb") as file:
            data = file.read(_MAX_BYTES + 1)
        if len(data) > _MAX_BYTES:
            raise SimError(f"{path} is too large: at most {_MAX_BYTES >> 20} MiB")
        rows = list(csv.reader(io.StringIO(data.decode("utf-8-sig"), newline=""), strict=True))
    except OSError as cause:
        raise SimError(f"cannot read {path}: {cause.strerror or cause}") from cause
    except (UnicodeDecodeError, csv.Error) as cause:
        raise SimError(f"{path} is not a CSV file: {cause}") from cause
    if not rows:
        return [], []
    numbered = [(line, row) for line, row in enumerate(rows[1:], start=2) if row]
    return [name.strip() for name in rows[0]], numbered


def _header_problems(header: Sequence[str]) -> Iterator[str]:
    for name in ("timestamp", "robot_x", "robot_y"):
        if name not in header:
            yield f"the column {name} is missing"
    if "column" in header:
        for name in ("x", "y"):
            if name not in header:
                yield f"the column {name} is missing"
    for name in header:
        pair = re.fullmatch(r"([xy])(\d+)", name)
        if name not in _LONG and pair is None:
            yield f"the column {name!r:.60} is none of NavWareSet's"
        if header.count(name) > 1:
            yield f"the column {name} is there {header.count(name)} times"
        if pair is not None and f"{'y' if pair[1] == 'x' else 'x'}{pair[2]}" not in header:
            yield f"the column {name} is there without its other coordinate"


def _number(cell: str) -> float | None:
    """Return a finite number; a whole one exactly, since a time in nanoseconds has 19 digits."""
    try:
        value = int(cell) if cell.isdecimal() and len(cell) < 20 else float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _row_of(line: int, header: Sequence[str], values: dict[str, float]) -> _Row:
    if "column" in header:
        people = {int(values["column"]): (values["x"], values["y"])}
    else:
        numbers = sorted(int(name[1:]) for name in header if re.fullmatch(r"x\d+", name))
        pairs = {each: (values[f"x{each}"], values[f"y{each}"]) for each in numbers}
        people = {each: pair for each, pair in pairs.items() if not math.isnan(sum(pair))}
    robot = (values["robot_x"], values["robot_y"], values.get("robot_yaw_rad"))
    return _Row(line, values["timestamp"], robot, people)


def _row_problems(rows: Sequence[_Row]) -> Iterator[str]:
    if not rows:
        yield "there are no rows"
    robots: dict[float, tuple[float, float, float | None]] = {}
    there: set[tuple[float, int]] = set()
    latest = -math.inf
    for row in rows:
        if row.stamp_ns < latest:
            yield f"line {row.line}: timestamp must not be earlier than the one before"
        latest = max(latest, row.stamp_ns)
        if robots.setdefault(row.stamp_ns, row.robot) != row.robot:
            yield f"line {row.line}: robot_x, robot_y differ from another row of this timestamp"
        for person in row.people:
            if (row.stamp_ns, person) in there:
                yield f"line {row.line}: column {person} is there twice at this timestamp"
            there.add((row.stamp_ns, person))
