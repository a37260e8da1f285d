"""Recorded tracks of people: read from a CSV table, and the motion along one of them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import uniform_filter1d

from awarenav.tracks import read_people_table
from perception.arrays import FloatArray
from tracking.people import FASTEST_MPS

from ...world.errors import SimError
from ..body import MAX_HEAD_YAW_RAD
from ._forces import robot_force
from ._head import clipped
from ._route import DesiredVelocity
from ._surroundings import RobotBody
from ._trajectory import State

_OPTIONAL: Final = ("heading_rad", "head_yaw_rad")
# Below this speed the direction of walking is noise and the body keeps its heading.
_HEADING_FROM_MPS: Final = 0.05
# A body without recorded headings turns along its walk, averaged over this time.
_TURN_SMOOTHING_S: Final = 0.4
_ROW_STEP_S: Final = 0.01
# A person off the track aims at the recorded place of the present time, and would reach it in this
# time; but is never faster than this, or than this factor times the recorded speed.
_RETURN_S: Final = 1.0
_OFF_TRACK_MPS: Final = 1.6
_OFF_TRACK_FACTOR: Final = 1.3
# A robot whose force is greater moves a person off the track.
_FORCED_OFF_MPS2: Final = 0.5
#: The body of somebody off the track faces where it walks from this speed on.
FACING_FROM_MPS: Final = 0.3
# The recording goes on from a place and a velocity this near to it.
_BACK_WITHIN_M: Final = 0.01
_BACK_WITHIN_MPS: Final = 0.05


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


class Track:
    """The motion along a recorded path.

    The rows are met exactly. Between them position and heading are monotone cubics and the head's
    yaw is linear. The person stands before the first and after the last row, or is away.

    Args:
        recording: the path of one person.
        reacts: the robot can force the person off the track.
        leaves: the person is away before the first and after the last row.
    """

    def __init__(
        self, recording: RecordedPath, *, reacts: bool = False, leaves: bool = False
    ) -> None:
        self.recording, self.reacts, self._leaves = recording, reacts, leaves
        times = recording.times_s
        self._first_s, self._last_s = float(times[0]), float(times[-1])
        self._position = self._velocity = self._heading = None
        self._along: tuple[FloatArray, FloatArray] | None = None
        if len(times) > 1:
            self._position = PchipInterpolator(times, recording.positions_odom_m)
            self._velocity = self._position.derivative()
            if recording.headings_odom_rad is not None:
                self._heading = PchipInterpolator(times, recording.headings_odom_rad)
            else:
                rows = np.arange(self._first_s, self._last_s + _ROW_STEP_S, _ROW_STEP_S)
                velocity = self._velocity(np.minimum(rows, self._last_s))
                self._along = rows, _headings_along(velocity)

    def is_away(self, t_s: float) -> bool:
        """Return whether the person is away at ``t_s``."""
        return self._leaves and not self._first_s <= t_s <= self._last_s

    def state(self, t_s: float) -> State:
        """Return the recorded position and velocity at a time."""
        if self._position is None or self._velocity is None:
            x, y = self.recording.positions_odom_m[0].tolist()
            return x, y, 0.0, 0.0
        x, y = self._position(self._within(t_s)).tolist()
        if not self._first_s <= t_s <= self._last_s:
            return x, y, 0.0, 0.0
        vx, vy = self._velocity(t_s).tolist()
        return x, y, vx, vy

    def heading_rad(self, t_s: float) -> float:
        """Return the recorded heading of the body in odom at a time."""
        if self._heading is not None:
            return float(self._heading(self._within(t_s)))
        if self._along is not None:
            return float(np.interp(t_s, *self._along))
        headings = self.recording.headings_odom_rad
        return 0.0 if headings is None else float(headings[0])

    def head_yaw_rad(self, t_s: float) -> float:
        """Return the recorded yaw of the head from the body at a time."""
        yaws = self.recording.head_yaws_rad
        if yaws is None:
            return 0.0
        return clipped(float(np.interp(t_s, self.recording.times_s, yaws)), MAX_HEAD_YAW_RAD)

    def fastest_mps(self, t_s: float) -> float:
        """Return the highest speed of somebody off the track."""
        return max(_OFF_TRACK_MPS, _OFF_TRACK_FACTOR * math.hypot(*self.state(t_s)[2:]))

    def velocity_back(self, t_s: float, x_m: float, y_m: float) -> DesiredVelocity:
        """Return the velocity that leads somebody at (x, y) back to the track."""
        x, y, vx, vy = self.state(t_s)
        wish_x, wish_y = vx + (x - x_m) / _RETURN_S, vy + (y - y_m) / _RETURN_S
        wish = math.hypot(wish_x, wish_y)
        if wish < 1e-9:
            return DesiredVelocity(1.0, 0.0, 0.0)
        return DesiredVelocity(wish_x / wish, wish_y / wish, min(wish, self.fastest_mps(t_s)))

    def facing_rad(self, t_s: float, desired: DesiredVelocity) -> float:
        """Return the heading of somebody off the track: where they walk, else as recorded."""
        if desired.speed_mps < FACING_FROM_MPS:
            return self.heading_rad(t_s)
        return math.atan2(desired.uy, desired.ux)

    def leads(
        self, t_s: float, state: State, robot: RobotBody | None, *, on_track: bool, startled: bool
    ) -> bool:
        """Return whether a person in this state moves as recorded from ``t_s`` on."""
        if robot is None or self.is_away(t_s):
            return True
        if startled:
            return False
        if self.reacts and math.hypot(*robot_force(*state, robot)) >= _FORCED_OFF_MPS2:
            return False
        return on_track or self._is_met(t_s, state)

    def _is_met(self, t_s: float, state: State) -> bool:
        """Return whether somebody in this state can go on as recorded."""
        x, y, vx, vy = self.state(t_s)
        return (
            math.hypot(x - state[0], y - state[1]) < _BACK_WITHIN_M
            and math.hypot(vx - state[2], vy - state[3]) < _BACK_WITHIN_MPS
        )

    def _within(self, t_s: float) -> float:
        return min(max(t_s, self._first_s), self._last_s)


def read_recordings(path: str | Path) -> tuple[RecordedPath, ...]:
    """Read the recorded paths of one or more people from a CSV file, in order of the first rows.

    The first line is the header; columns and rows may be in any order. ``t_s, id, x_m, y_m`` are
    required. ``heading_rad`` (of the body) and ``head_yaw_rad`` (of the head from the body, left
    positive) are optional; each is filled in every row of a person or in none. Positions and
    headings are in odom.

    Raises:
        SimError: for a file that cannot be read, a missing or unknown column, a value that is not a
            finite number, two rows of a person with one time, or a jump; the message says where.
    """
    path = Path(path)
    table = read_people_table(path, _OPTIONAL, SimError)
    if table.ignored:
        raise SimError(
            f"{path}: the header has unknown columns {', '.join(map(repr, table.ignored))}; it "
            f"must name t_s, id, x_m, y_m and may name {', '.join(_OPTIONAL)}"
        )
    people: dict[str, list[tuple[list[float | None], int]]] = {}
    for row in table.rows:
        values = [row.t_s, row.x_m, row.y_m, *(row.more.get(name) for name in _OPTIONAL)]
        people.setdefault(row.id, []).append((values, row.line))
    return tuple(_recorded_path(path, name, own) for name, own in people.items())


def _recorded_path(
    path: Path, name: str, rows: list[tuple[list[float | None], int]]
) -> RecordedPath:
    """Return one person's rows in order of time."""
    for number, column in enumerate(_OPTIONAL, 3):
        empty = [line for values, line in rows if values[number] is None]
        if 0 < len(empty) < len(rows):
            raise SimError(
                f"{path}, line {empty[0]}: {column} of {name!r} is empty here and given elsewhere; "
                "give it in all of a person's rows or in none"
            )
    rows = sorted(rows, key=lambda row: row[0][0] or 0.0)
    table = np.array([values for values, _ in rows], dtype=np.float64)
    for row, (before, after) in enumerate(itertools.pairwise(table.tolist()), 1):
        elapsed_s, moved_m = after[0] - before[0], math.dist(before[1:3], after[1:3])
        where = f"{path}, line {rows[row][1]}: {name!r}"
        if elapsed_s <= 0.0:
            raise SimError(f"{where} has two rows for t_s = {after[0]:g} s")
        if moved_m > FASTEST_MPS * elapsed_s:
            raise SimError(
                f"{where} moves {moved_m:.3g} m in {elapsed_s:.3g} s, faster than "
                f"{FASTEST_MPS:g} m/s; t_s is in seconds, x_m and y_m are in metres"
            )
    headings, head_yaws = (
        None if np.isnan(table[:, number]).any() else table[:, number] for number in (3, 4)
    )
    return RecordedPath(
        name,
        table[:, 0],
        table[:, 1:3],
        None if headings is None else np.unwrap(headings),
        head_yaws,
    )


def _headings_along(velocity_mps: FloatArray) -> FloatArray:
    """Return (N,) unwrapped, smoothed directions of walking, held while the body hardly moves."""
    moving = np.flatnonzero(np.linalg.norm(velocity_mps, axis=1) > _HEADING_FROM_MPS)
    if not len(moving):
        return np.zeros(len(velocity_mps))
    place = np.searchsorted(moving, np.arange(len(velocity_mps)))
    nearest = moving[np.clip(place, 0, len(moving) - 1)]
    along = np.unwrap(np.arctan2(velocity_mps[:, 1], velocity_mps[:, 0])[nearest])
    size = 2 * round(0.5 * _TURN_SMOOTHING_S / _ROW_STEP_S) + 1
    return np.asarray(uniform_filter1d(along, size, mode="nearest"))
