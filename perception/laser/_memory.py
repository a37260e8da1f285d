"""The part of the surroundings that stands still, learned: an occupancy memory in odom."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from ._points import ScanPoints

# Extent and cell of the memory, which follows the robot.
_CELLS: Final = 400
_CELL_M: Final = 0.1
# The memory is moved once the robot is this far from its middle.
_MOVED_M: Final = 8.0
# Rays free the floor up to this distance from the scanner, and this far before what they meet.
_FREE_M: Final = 8.0
_BEFORE_M: Final = 0.15
_STEPS_M: Final = np.arange(_CELL_M, _FREE_M, _CELL_M)
# Stride of the rays, and the distances along them, at which cells are freed.
_STRIDES: Final = tuple(
    (stride, _STEPS_M[(low < _STEPS_M) & (high >= _STEPS_M)])
    for stride, low, high in ((8, 0.0, 2.0), (4, 2.0, 4.0), (2, 4.0, _FREE_M))
)
# Time between two updates, and the longest time that one update counts for.
_PERIOD_S: Final = 0.2
_MAX_PERIOD_S: Final = 0.4
# Something that has been met for this long stands still. Being passed takes back a part of it.
_STATIC_S: Final = 1.5
_FREE_FACTOR: Final = np.float32(0.5)
# No more than this is counted, so that a person who was not recognised at first is soon again one.
_MOST_S: Final = 3.0
# Farther away too few rays meet somebody's legs to tell them from a post.
_LEARN_M: Final = 6.0
# Floor that was free for this long before anything was met in it or beside it was no structure;
# what stands there later has come.
_CAME_S: Final = 0.6
# Of a cell and its neighbours, those that must have been free.
_CAME_CELLS: Final = 8
# A return of a person takes back this much of what was counted there.
_PERSON_FACTOR: Final = np.float32(2.0)
# A return may fall into the cell beside that of its surface.
_BESIDE: Final = np.array([row * _CELLS + column for row in (-1, 0, 1) for column in (-1, 0, 1)])
# For so long, and this many cells to each side, it is remembered that somebody had two legs.
_TWO_LEGS_S: Final = 5.0
_NEAR_LEGS: Final = np.array(
    [row * _CELLS + column for row in range(-2, 3) for column in range(-2, 3)]
)


class OccupancyMemory:
    """Remembers for how long each cell of the floor was occupied and free.

    A cell becomes static after 1.5 s of returns. Returns that may belong to a person are not
    counted and take back others, so that somebody who stands still is not forgotten. What stands
    where the floor was free before anything was met there has come: it is no structure.
    """

    def __init__(self) -> None:
        self._origin = np.zeros(2)
        self._occupied_s = np.zeros((_CELLS, _CELLS), dtype=np.float32)
        # How long a cell was free until anything, people too, was met in it or beside it.
        self._untouched_s = np.zeros((_CELLS, _CELLS), dtype=np.float32)
        self._touched = np.zeros((_CELLS, _CELLS), dtype=np.float32)
        # When somebody was last seen on two legs near a cell.
        self._two_legs_s = np.full((_CELLS, _CELLS), -np.inf)
        self._updated_s: dict[int, float] = {}
        self._placed = False

    def note_two_legs(self, places_m: FloatArray, stamp_s: float) -> None:
        """Remember where (K, 2) people were seen on two legs."""
        cells, inside = self._cells(places_m)
        self._two_legs_s.put(cells[inside, None] + _NEAR_LEGS, stamp_s, mode="clip")

    def had_two_legs(self, points_m: FloatArray, stamp_s: float) -> NDArray[np.bool_]:
        """Return (N,) whether somebody was seen on two legs near points (N, 2) within 5 s."""
        cells, inside = self._cells(points_m)
        since = stamp_s - self._two_legs_s.take(cells)
        return np.asarray(inside & (since >= 0.0) & (since <= _TWO_LEGS_S))

    def known(self, points_m: FloatArray) -> NDArray[np.int64]:
        """Return (N,) −1 for points (N, 2) that are static, 1 for what has come, 0 otherwise."""
        cells, inside = self._cells(points_m)
        untouched = self._untouched_s.ravel()
        free = untouched.take(cells) >= _CAME_S
        known = np.zeros(len(cells), dtype=np.int64)
        static = self._occupied_s.take(cells) >= _STATIC_S
        static &= ~free & inside
        np.putmask(known, static, -1)
        # All cells around but one must have been free: of any two, at least one.
        free |= untouched.take(cells + 1, mode="clip") >= _CAME_S
        free &= inside
        maybe = free.nonzero()[0]
        around = untouched.take(cells[maybe, None] + _BESIDE, mode="clip")
        known[maybe[(around >= _CAME_S).sum(axis=1) >= _CAME_CELLS]] = 1
        return known

    def is_due(self, stamp_s: float, scanner: int = 0) -> bool:
        """Return whether a scan of this time is needed; :meth:`update` takes no other."""
        since = stamp_s - self._updated_s.get(scanner, -math.inf)
        return not 0.0 <= since < _PERIOD_S

    def update(self, points: ScanPoints, person: NDArray[np.bool_], scanner: int = 0) -> bool:
        """Add a scan; return False where it comes too soon after the last one to be needed.

        Args:
            points: the scan.
            person: (N,) which of its rays met a person.
            scanner: number of the scanner; each has its own period.
        """
        if not self.is_due(points.stamp_s, scanner):
            return False
        since = points.stamp_s - self._updated_s.get(scanner, -math.inf)
        self._updated_s[scanner] = points.stamp_s
        dt = _PERIOD_S if not 0.0 <= since <= _MAX_PERIOD_S else since
        rows = points.usable.nonzero()[0]
        if not len(rows):
            return True
        starts, ends = points.origins_odom_m[rows, :2], points.points_odom_m[rows, :2]
        self._follow(starts[0])
        hits, inside = self._cells(ends)
        occupied = self._occupied_s.ravel()
        untouched, touched = self._untouched_s.ravel(), self._touched.ravel()
        freed = self._passed(starts, ends, points.ranges_m[rows])
        touched.put(hits[inside, None] + _BESIDE, 1.0, mode="clip")
        # Cells that several rays pass are counted once; a return there counts more than passing.
        before = occupied[hits]
        occupied[freed] = np.maximum(occupied[freed] - _FREE_FACTOR * np.float32(dt), 0.0)
        occupied[hits] = before
        untouched[freed] += np.float32(dt) * (1.0 - touched[freed])
        near = points.ranges_m[rows] <= _LEARN_M
        met, people = hits[inside & near & ~person[rows]], hits[inside & person[rows]]
        occupied[met] = np.minimum(occupied[met] + np.float32(dt), _MOST_S)
        occupied[people] = np.maximum(occupied[people] - _PERSON_FACTOR * np.float32(dt), 0.0)
        return True

    def _passed(
        self, starts_m: FloatArray, ends_m: FloatArray, ranges_m: FloatArray
    ) -> NDArray[np.int32]:
        """Return the cells that rays pass before they meet something."""
        scale = 1.0 / _CELL_M
        first = (starts_m - self._origin) * scale
        unit = (ends_m - starts_m) * (scale / ranges_m)[:, None]
        far = _FREE_M * scale
        inside = ((first >= far) & (first < _CELLS - far)).all(axis=1)
        reach = np.where(inside, np.minimum(ranges_m - _BEFORE_M, _FREE_M), 0.0)
        cells = []
        # Near the scanner many rays pass the same cell: some of them are enough.
        for stride, along in _STRIDES:
            rays = stride * (reach[::stride] > along[0]).nonzero()[0]
            x, y = (
                (first[rays, axis, None] + along * unit[rays, axis, None]).astype(np.int32)
                for axis in (0, 1)
            )
            y *= _CELLS
            y += x
            cells.append(y[along < reach[rays, None]])
        return np.concatenate(cells)

    def _cells(self, points_m: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the flat index (N,) of every point's cell, 0 outside, and which are inside."""
        off = points_m.T - self._origin[:, None]
        both = (off >= 0.0) & (off < _CELLS * _CELL_M)
        inside = both[0] & both[1]
        if not inside.all():
            off = np.where(inside, off, 0.0)
        off *= 1.0 / _CELL_M
        cells = off.astype(np.int64)
        np.minimum(cells, _CELLS - 1, out=cells)
        cells[1] *= _CELLS
        return cells[0] + cells[1], inside

    def _follow(self, place_m: FloatArray) -> None:
        """Move the memory so that the robot stays in its middle."""
        middle = self._origin + 0.5 * _CELLS * _CELL_M
        if not self._placed:
            self._origin = np.round(place_m / _CELL_M) * _CELL_M - 0.5 * _CELLS * _CELL_M
            self._placed = True
            return
        off = place_m - middle
        if float(np.abs(off).max()) <= _MOVED_M:
            return
        columns, rows = np.round(off / _CELL_M).astype(int).tolist()
        self._origin = self._origin + np.array([columns, rows]) * _CELL_M
        for name in ("_occupied_s", "_untouched_s", "_touched"):
            setattr(self, name, _shifted(getattr(self, name), rows, columns, 0.0))
        self._two_legs_s = _shifted(self._two_legs_s, rows, columns, -np.inf)


def _shifted(grid: NDArray[Any], rows: int, columns: int, new: float) -> NDArray[Any]:
    """Return the grid as seen from an origin that moved by rows and columns."""
    out = np.full_like(grid, new)
    size = len(grid)
    if max(abs(rows), abs(columns)) >= size:
        return out
    into = tuple(slice(max(-step, 0), size - max(step, 0)) for step in (rows, columns))
    source = tuple(slice(max(step, 0), size - max(-step, 0)) for step in (rows, columns))
    out[into] = grid[source]
    return out
