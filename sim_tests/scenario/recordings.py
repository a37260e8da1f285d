"""Recordings of people as scenarios: tables read and checked, resampled paths, a robot's task."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from awarenav.files import printable, write_csv, write_text
from awarenav.tracks import person_id, read_people_table
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray, finite_array, finite_number
from perception.documents import yaml_text
from tracking.people import FASTEST_MPS

from ..actors.robot import NOVA_CARTER
from ..world.errors import SimError
from ._scenario import Scenario
from .catalogue import robot_plan

_Point = tuple[float, float]

_HEADINGS: Final = {"heading_rad": 1.0, "heading_deg": math.pi / 180.0}
#: A longer time without a row is no gap to fill: the person was away.
LONGEST_GAP_S: Final = 0.5
# Nobody is recorded on a larger floor.
_LARGEST_FLOOR_M: Final = 300.0
# A row this many usual steps after the one before it ends a gap.
_GAP_STEPS: Final = 1.5
# The floor ends this far beyond people, start and goal.
_MARGIN_M: Final = 3.0
# Without a task the robot drives along the longer side of the floor, from and to this far outside.
_OUTSIDE_M: Final = 1.0
_SHORTEST_TASK_M: Final = 1.0
_LONGEST_S: Final = 600.0
# The robot has at least this time, and as long as the way takes at half its speed.
_SPARE_S: Final = 10.0
# Rows a second of the people's table.
_RATE_HZ: Final = 10.0
# Samples within half this time of an instant give its position.
_SMOOTHING_S: Final = 0.2


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


@dataclass(frozen=True, slots=True)
class RecordingOptions:
    """The settings with which a recording becomes a scenario.

    Attributes:
        react: people leave their paths where the robot forces them off, and return.
        robot_id: ``id`` of a robot's rows; it is no person, and its first and last place are start
            and goal.
        start_odom_m: start of the robot; None is that of ``robot_id``, or the middle of an end of
            the floor.
        goal_odom_m: goal of the robot; None as for the start.
        from_s: the episode begins at this time of the recording; None at its first row.
        until_s: rows after this time are left out; None leaves none out.
    """

    react: bool = False
    robot_id: str | None = None
    start_odom_m: _Point | None = None
    goal_odom_m: _Point | None = None
    from_s: float | None = None
    until_s: float | None = None


@dataclass(frozen=True, slots=True)
class ConvertedRecording:
    """A scenario made from a recording.

    Attributes:
        scenario: the written file.
        people: the written table of its people.
        remarks: sentences about what was read and made.
    """

    scenario: Path
    people: Path
    remarks: tuple[str, ...]


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
        gaps = steps_s > LONGEST_GAP_S
        _check_steps(path, name, lines, values, gaps)
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


def _check_steps(
    path: Path, name: str, lines: FloatArray, values: FloatArray, gaps: NDArray[np.bool_]
) -> None:
    """Raise SimError for the first step back in time, or the first one faster than a person."""
    steps_s = np.diff(values[:, 0])
    moved_m = np.linalg.norm(np.diff(values[:, 1:3], axis=0), axis=1)
    for row in np.flatnonzero(steps_s <= 0.0)[:1].tolist():
        before_s, after_s = values[row : row + 2, 0].tolist()
        what = (
            f"has two rows for t_s = {after_s:g} s"
            if before_s == after_s
            else f"goes back in time, from {before_s:g} to {after_s:g} s"
        )
        raise SimError(f"{path}, line {lines[row + 1]}: {name!r} {what}")
    for row in np.flatnonzero((moved_m > FASTEST_MPS * steps_s) & ~gaps)[:1].tolist():
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


def scenario_from_recording(
    table: Path | str, out: Path | str, options: RecordingOptions | None = None
) -> ConvertedRecording:
    """Write a scenario of recorded people, and their resampled paths beside it.

    Positions stay as recorded. Time 0 is the recording's start, or ``from_s``.

    Args:
        table: CSV, see :func:`read_table`.
        out: the scenario's YAML file; the people go to ``NAME_people.csv`` beside it.
        options: None for the defaults.

    Raises:
        SimError: for a table that cannot be used, see :func:`read_table`; an unknown ``robot_id``;
            nobody in the chosen time; a start on top of a person; and a goal where somebody stands
            until they leave.
    """
    options = RecordingOptions() if options is None else options
    _check_options(options)
    table, out = Path(table), Path(out)
    people_file = out.with_name(f"{out.stem}_people.csv")
    if out.suffix not in (".yaml", ".yml"):
        raise SimError(f"the scenario must be a file that ends in .yaml, got {out}")
    if printable(out.name) != out.name:
        raise SimError(f"the scenario's file must have a name in UTF-8, got {out}")
    if table.resolve() in (out.resolve(), people_file.resolve()):
        raise SimError(f"{people_file} would overwrite the recording {table}")
    recorded = read_table(table)
    robot, tracks = _split(recorded, table, options)
    begin_s = min(track.times_s[0] for track in (robot or tracks))
    begin_s = float(begin_s if options.from_s is None else options.from_s)
    end_s = math.inf if options.until_s is None else options.until_s
    people = [
        resampled
        for track in tracks
        if (resampled := _resampled(track, begin_s, end_s)) is not None
    ]
    if not people:
        raise SimError(
            f"{table}: nobody has two rows from {begin_s:g} s on"
            + (f" up to {end_s:g} s" if math.isfinite(end_s) else "")
        )
    start, goal = _task(table, people, robot, options)
    _check_start(start, people)
    _check_goal(start, goal, people)
    data = _scenario_data(table, people_file.name, people, (start, goal), options)
    text = yaml_text(data, width=100)
    scenario = Scenario.from_text(text, str(out))
    _write_people(people_file, people)
    write_text(out, text, SimError)
    return ConvertedRecording(out, people_file, _remarks(recorded, people, scenario))


def _check_options(options: RecordingOptions) -> None:
    for name in ("from_s", "until_s"):
        value = getattr(options, name)
        if value is not None:
            finite_number(name, value, SimError)
    for name in ("start_odom_m", "goal_odom_m"):
        value = getattr(options, name)
        if value is not None:
            finite_array(name, value, (2,), SimError)


def _split(
    recorded: RecordedTable, table: Path, options: RecordingOptions
) -> tuple[tuple[RecordedTrack, ...], tuple[RecordedTrack, ...]]:
    """Return the tracks of the robot and of the people."""
    if options.robot_id is None:
        return (), recorded.tracks
    robot_id = person_id(options.robot_id)
    robot = recorded.of(robot_id)
    if not robot:
        ids = dict.fromkeys(track.id for track in recorded.tracks)
        raise SimError(
            f"{table} has no rows of the robot {options.robot_id!r}; its ids are {', '.join(ids)}"
        )
    people = tuple(track for track in recorded.tracks if track.id != robot_id)
    if not people:
        raise SimError(f"{table} has only rows of the robot {options.robot_id!r}")
    return robot, people


def _resampled(track: RecordedTrack, begin_s: float, end_s: float) -> RecordedTrack | None:
    """Return a track at whole multiples of the period after ``begin_s``; None without two rows.

    The position at an instant is that of a line fitted to the samples within 0.1 s of it, or lies
    between its neighbours where there are fewer than three.
    """
    first = math.ceil((max(track.times_s[0], begin_s) - begin_s) * _RATE_HZ - 1e-6)
    last = math.floor((min(track.times_s[-1], end_s) - begin_s) * _RATE_HZ + 1e-6)
    if last <= first:
        return None
    times = np.arange(first, last + 1) / _RATE_HZ
    at_s = np.clip(times + begin_s, track.times_s[0], track.times_s[-1])
    positions = np.column_stack(
        [np.interp(at_s, track.times_s, track.positions_odom_m[:, axis]) for axis in (0, 1)]
    )
    lows = np.searchsorted(track.times_s, at_s - 0.5 * _SMOOTHING_S - 1e-9)
    highs = np.searchsorted(track.times_s, at_s + 0.5 * _SMOOTHING_S + 1e-9)
    for row, (low, high) in enumerate(zip(lows.tolist(), highs.tolist(), strict=True)):
        if high - low >= 3:
            ahead_s = track.times_s[low:high] - at_s[row]
            middle_s = ahead_s.mean()
            near = track.positions_odom_m[low:high]
            slope = (ahead_s - middle_s) @ near / ((ahead_s - middle_s) ** 2).sum()
            positions[row] = near.mean(axis=0) - slope * middle_s
    headings = track.headings_odom_rad
    if headings is not None:
        headings = np.interp(at_s, track.times_s, headings)
    return replace(track, times_s=times, positions_odom_m=positions, headings_odom_rad=headings)


def _task(
    table: Path,
    people: list[RecordedTrack],
    robot: tuple[RecordedTrack, ...],
    options: RecordingOptions,
) -> tuple[_Point, _Point]:
    """Return start and goal: as given, as the robot drove, or along the longer side."""
    if robot:
        ends = robot[0].positions_odom_m[0], robot[-1].positions_odom_m[-1]
    else:
        places = np.vstack([track.positions_odom_m for track in people])
        low, high = places.min(axis=0), places.max(axis=0)
        longer = int(high[1] - low[1] > high[0] - low[0])
        ends = np.median(places, axis=0), np.median(places, axis=0)
        ends[0][longer], ends[1][longer] = low[longer] - _OUTSIDE_M, high[longer] + _OUTSIDE_M
    start = options.start_odom_m or _rounded(ends[0])
    goal = options.goal_odom_m or _rounded(ends[1])
    if math.dist(start, goal) < _SHORTEST_TASK_M:
        raise SimError(
            f"{table}: start {start} and goal {goal} of the robot are less than "
            f"{_SHORTEST_TASK_M:g} m apart; give --start and --goal"
        )
    return start, goal


def _rounded(point: FloatArray) -> _Point:
    x, y = np.round(point, 2).tolist()
    return x, y


def _check_start(start: _Point, people: list[RecordedTrack]) -> None:
    """Raise SimError if somebody is where the robot starts."""
    for track in people:
        if track.times_s[0] <= 0.0 <= track.times_s[-1]:
            row = int(np.searchsorted(track.times_s, 0.0))
            gap_m = math.dist(start, track.positions_odom_m[row].tolist())
            _refuse_near("start", start, track.name, gap_m, 0.0)


def _check_goal(start: _Point, goal: _Point, people: list[RecordedTrack]) -> None:
    """Raise SimError if somebody stands at the goal from the robot's earliest arrival on.

    People who pass, or leave before the robot comes, are no obstacle.
    """
    arrival_s = math.dist(start, goal) / NOVA_CARTER.max_speed_mps
    for track in people:
        later = track.positions_odom_m[track.times_s >= arrival_s]
        if len(later):
            gap_m = float(np.linalg.norm(later - goal, axis=1).max())
            _refuse_near("goal", goal, track.name, gap_m, arrival_s)


def _refuse_near(what: str, place: _Point, name: str, gap_m: float, at_s: float) -> None:
    apart_m = NOVA_CARTER.circumscribed_radius_m + BODY_RADIUS_M
    if gap_m < apart_m:
        raise SimError(
            f"the robot's {what} ({place[0]:g}, {place[1]:g}) m is {gap_m:.2f} m from {name!r} at "
            f"{at_s:.1f} s; it needs {apart_m:.2f} m: give another --{what}"
        )


def _scenario_data(
    table: Path,
    people_file: str,
    people: list[RecordedTrack],
    task: tuple[_Point, _Point],
    options: RecordingOptions,
) -> dict[str, Any]:
    places = np.vstack([*(track.positions_odom_m for track in people), np.array(task)])
    low, high = np.floor(places.min(axis=0) - _MARGIN_M), np.ceil(places.max(axis=0) + _MARGIN_M)
    start, goal = task
    span_s = max(float(track.times_s[-1]) for track in people)
    drive_s = _SPARE_S + 2.0 * math.dist(start, goal) / NOVA_CARTER.max_speed_mps
    does = (
        "They follow the recording until the robot forces them off it, and then return."
        if options.react
        else "They do not react to the robot."
    )
    count = f"{len(people)} recorded {'path' if len(people) == 1 else 'paths'}"
    heading = math.degrees(math.atan2(goal[1] - start[1], goal[0] - start[0]))
    return {
        "name": Path(people_file).stem.removesuffix("_people"),
        "version": 1,
        "description": f"People of {printable(table.name)}: {count} of {span_s:.1f} s. {does}",
        "attention": "mixed",
        "extends": "hall",
        "duration_s": round(min(max(span_s, drive_s), _LONGEST_S), 1),
        "layout": {
            "x_min_m": float(low[0]),
            "y_min_m": float(low[1]),
            "x_max_m": float(high[0]),
            "y_max_m": float(high[1]),
        },
        "robot": {
            "start_x_m": start[0],
            "start_y_m": start[1],
            "start_heading_deg": round(heading, 1),
            "goal_x_m": goal[0],
            "goal_y_m": goal[1],
        },
        "replay_csv": people_file,
        "replay_reacts": options.react,
        "replay_leaves": True,
    }


def _write_people(path: Path, people: list[RecordedTrack]) -> None:
    header, rows = ["t_s", "id", "x_m", "y_m"], []
    if people[0].headings_odom_rad is not None:
        header.append("heading_rad")
    for track in people:
        columns = [track.times_s, *track.positions_odom_m.T]
        if track.headings_odom_rad is not None:
            columns.append(track.headings_odom_rad)
        for t_s, *values in np.column_stack(columns).tolist():
            rows.append([f"{t_s:.4f}", track.name, *(f"{value:.4f}" for value in values)])
    write_csv(path, header, rows, SimError)


def _remarks(
    recorded: RecordedTable, people: list[RecordedTrack], scenario: Scenario
) -> tuple[str, ...]:
    """Return what was read and made, one sentence each."""
    task, hall = scenario.robot, scenario.layout
    found = [scenario.description]
    if recorded.filled_gaps or recorded.long_gaps or recorded.lone_rows:
        found.append(
            f"Gaps: {recorded.filled_gaps} of at most 0.5 s filled; at {recorded.long_gaps} longer "
            f"ones people leave and come back; {recorded.lone_rows} lone rows left out."
        )
    if recorded.ignored:
        found.append(f"Columns that are not read: {', '.join(recorded.ignored)}.")
    found.append(
        f"Floor {hall.x_max_m - hall.x_min_m:g} m by {hall.y_max_m - hall.y_min_m:g} m, robot from "
        f"({task.start_x_m:g}, {task.start_y_m:g}) to ({task.goal_x_m:g}, {task.goal_y_m:g}) m."
    )
    nearest = []
    for track in people:
        robot = robot_plan(task, track.times_s, scenario.robot_profile)
        gaps_m = np.linalg.norm(track.positions_odom_m - robot, axis=1)
        row = int(gaps_m.argmin())
        nearest.append((float(gaps_m[row]), float(track.times_s[row]), track.name))
    gap_m, at_s, name = min(nearest)
    found.append(
        f"If the robot drove straight on, it would come within {gap_m:.2f} m of {name!r} at "
        f"{at_s:.1f} s."
    )
    return tuple(found)
