"""People whose paths were recorded, replayed from a CSV table."""

from __future__ import annotations

import csv
import itertools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.interpolate import PchipInterpolator

from perception.arrays import FloatArray

from ...world.errors import SimError
from ..body import MAX_HEAD_YAW_RAD, Activity, PlannedGait, skeleton, worker_names
from ._person import PersonMotion, Surroundings
from ._planned_walk import HeadingKey, PlannedWalk, Waypoint

_REQUIRED: Final = ("t_s", "id", "x_m", "y_m")
_OPTIONAL: Final = ("heading_rad", "head_yaw_rad")
_IDLE: Final = Activity()
_STATURE_M: Final = 1.75
# A faster person was mixed up with another one, or the units are wrong.
_MAX_SPEED_MPS: Final = 12.0
# People who are away are this far from their place, out of every sensor's range.
_AWAY_M: Final = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class RecordedPath:
    """The recorded path of one person.

    Attributes:
        name: ``id`` in the table.
        times_s: (N,) increasing.
        positions_odom_m: (N, 2).
        headings_odom_rad: (N,) heading of the body, unwrapped; None faces along the path.
        head_yaws_rad: (N,) yaw of the head from the body, left positive; None looks ahead.
    """

    name: str
    times_s: FloatArray
    positions_odom_m: FloatArray
    headings_odom_rad: FloatArray | None
    head_yaws_rad: FloatArray | None


class Replayed:
    """A person who follows a recorded path regardless of the surroundings.

    The rows are met exactly. Between them position and heading are monotone cubics and the head's
    yaw is linear. The person stands before the first and after the last row, or is away.

    Args:
        recording: the path of one person.
        look: name of a shipped worker; None is the one of nearest stature.
        stature_m: height of the body.
        leaves: the person is away, 1 km off, before the first and after the last row.

    Attributes:
        recording: as given.
    """

    def __init__(
        self,
        recording: RecordedPath,
        look: str | None = None,
        stature_m: float = _STATURE_M,
        *,
        leaves: bool = False,
    ) -> None:
        self.recording = recording
        self._leaves = leaves
        self._look, self._stature_m = look, stature_m
        times = recording.times_s
        path = tuple(
            Waypoint(t_s=t, x_m=x, y_m=y)
            for t, (x, y) in zip(times.tolist(), recording.positions_odom_m.tolist(), strict=True)
        )
        headings: tuple[HeadingKey, ...] = ()
        if recording.headings_odom_rad is not None:
            degrees = np.degrees(recording.headings_odom_rad).tolist()
            headings = tuple(
                HeadingKey(t_s=t, heading_deg=angle)
                for t, angle in zip(times.tolist(), degrees, strict=True)
            )
        self._walk = PlannedWalk(path, headings, PlannedGait(skeleton(look, stature_m)))
        # Exact splines: the planned walk's table interpolates between its rows.
        self._position = self._velocity = self._heading = None
        if len(times) > 1:
            self._position = PchipInterpolator(times, recording.positions_odom_m)
            self._velocity = self._position.derivative()
            if recording.headings_odom_rad is not None:
                self._heading = PchipInterpolator(times, recording.headings_odom_rad)

    @property
    def stature_m(self) -> float:
        """Height of the body."""
        return self._stature_m

    @property
    def look(self) -> str | None:
        """Name of a shipped worker."""
        return self._look

    @property
    def stride_m(self) -> float | None:
        """None: the stride follows the speed."""
        return None

    def is_away(self, t_s: float) -> bool:
        """Return whether the person is away at ``t_s``."""
        times = self.recording.times_s
        return self._leaves and not times[0] <= t_s <= times[-1]

    def motion(self, t_s: float, around: Surroundings) -> PersonMotion:
        """Return the recorded motion at ``t_s``."""
        recording = self.recording
        first, last = float(recording.times_s[0]), float(recording.times_s[-1])
        at_s = min(max(t_s, first), last)
        walk = self._walk.motion(t_s)
        position, velocity = recording.positions_odom_m[0], np.zeros(2)
        heading = walk.heading_odom_rad
        if self._position is not None and self._velocity is not None:
            position = np.asarray(self._position(at_s))
            if first <= t_s <= last:
                velocity = np.asarray(self._velocity(at_s))
        if self._heading is not None:
            heading = float(self._heading(at_s))
        yaw = 0.0
        if recording.head_yaws_rad is not None:
            yaw = float(np.interp(at_s, recording.times_s, recording.head_yaws_rad))
        feet = walk.feet
        if self.is_away(t_s):
            position = position + np.array([_AWAY_M, 0.0])
            feet = feet.moved(_AWAY_M, 0.0)
        return PersonMotion(
            position_odom_m=position,
            velocity_odom_mps=velocity,
            heading_odom_rad=heading,
            walked_m=walk.walked_m,
            feet=feet,
            head_yaw_rad=min(max(yaw, -MAX_HEAD_YAW_RAD), MAX_HEAD_YAW_RAD),
            head_pitch_rad=0.0,
            eye_yaw_rad=0.0,
            eye_pitch_rad=0.0,
            activity=_IDLE,
            away=self.is_away(t_s),
        )

    def hold(self) -> None:
        """Do nothing: the recording continues."""

    def touch(self, towards_x: float, towards_y: float) -> None:
        """Do nothing: the recording continues."""


def replayed_people(path: str | Path, *, leaves: bool = False) -> tuple[Replayed, ...]:
    """Return the people of a table in order of their first rows, with different looks.

    Args:
        path: the table.
        leaves: as for :class:`Replayed`.

    Raises:
        SimError: see :func:`read_recordings`.
    """
    looks = worker_names()
    return tuple(
        Replayed(recording, looks[number % len(looks)], leaves=leaves)
        for number, recording in enumerate(read_recordings(path))
    )


def read_recordings(path: str | Path) -> tuple[RecordedPath, ...]:
    """Read the recorded paths of one or more people from a CSV file.

    The first line is the header; columns and rows may be in any order. ``t_s, id, x_m, y_m`` are
    required. ``heading_rad`` (of the body) and ``head_yaw_rad`` (of the head from the body, left
    positive) are optional; each is filled in every row of a person or in none. Positions and
    headings are in odom.

    Raises:
        SimError: for a file that cannot be read, a missing or unknown column, a value that is not a
            finite number, two rows of a person with one time, or a jump; the message says where.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            names = [name.strip() for name in reader.fieldnames or ()]
            _check_columns(path, names)
            reader.fieldnames = names
            rows = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as cause:
        reason = cause.strerror if isinstance(cause, OSError) and cause.strerror else cause
        raise SimError(f"cannot read recorded people from {path}: {reason}") from cause
    if not rows:
        raise SimError(f"{path} holds no rows below its header {', '.join(names)}")
    people: dict[str, list[tuple[int, dict[str, str | None]]]] = {}
    for line, row in rows:
        name = (row["id"] or "").strip()
        if not name:
            raise SimError(f"{path}, line {line}: id is empty")
        people.setdefault(name, []).append((line, row))
    return tuple(_recorded_path(path, name, own) for name, own in people.items())


def _check_columns(path: Path, names: list[str]) -> None:
    missing = [name for name in _REQUIRED if name not in names]
    unknown = [name for name in names if name not in (*_REQUIRED, *_OPTIONAL)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if missing or unknown or twice:
        what = (
            f"misses {', '.join(missing)}"
            if missing
            else f"has unknown columns {', '.join(map(repr, unknown))}"
            if unknown
            else f"names {', '.join(twice)} twice"
        )
        raise SimError(
            f"{path}: the header {what}; it must name {', '.join(_REQUIRED)} and may name "
            f"{', '.join(_OPTIONAL)}"
        )


def _recorded_path(
    path: Path, name: str, rows: list[tuple[int, dict[str, str | None]]]
) -> RecordedPath:
    """Return one person's rows in order of time."""
    columns = ["t_s", "x_m", "y_m"]
    for column in _OPTIONAL:
        filled = [bool((row.get(column) or "").strip()) for _, row in rows]
        if all(filled):
            columns.append(column)
        elif any(filled):
            line = rows[filled.index(False)][0]
            raise SimError(
                f"{path}, line {line}: {column} of {name!r} is empty here and given elsewhere; "
                "give it in all of a person's rows or in none"
            )
    values = sorted(
        ([_finite_number(path, line, column, row.get(column)) for column in columns], line)
        for line, row in rows
    )
    for (before, _), (after, line) in itertools.pairwise(values):
        elapsed_s, moved_m = after[0] - before[0], math.dist(before[1:3], after[1:3])
        if elapsed_s <= 0.0:
            raise SimError(f"{path}, line {line}: {name!r} has two rows for t_s = {after[0]:g} s")
        if moved_m > _MAX_SPEED_MPS * elapsed_s:
            raise SimError(
                f"{path}, line {line}: {name!r} moves {moved_m:.3g} m in {elapsed_s:.3g} s, faster "
                f"than {_MAX_SPEED_MPS:g} m/s; t_s is in seconds, x_m and y_m are in metres"
            )
    table = np.array([row for row, _ in values])
    optional = {column: table[:, 3 + at] for at, column in enumerate(columns[3:])}
    headings, head_yaws = (optional.get(column) for column in _OPTIONAL)
    return RecordedPath(
        name,
        table[:, 0],
        table[:, 1:3],
        None if headings is None else np.unwrap(headings),
        head_yaws,
    )


def _finite_number(path: Path, line: int, column: str, text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise SimError(f"{path}, line {line}: {column} must be a finite number, got {text!r}")
    return value
