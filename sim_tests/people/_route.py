"""The way that a person means to go: corners, stops and the way back."""

from __future__ import annotations

import bisect
import itertools
import math
from dataclasses import dataclass
from typing import Final

from ._person_spec import PersonSpec

# Turning back takes a moment.
_ABOUT_TURN_S: Final = 0.4
_LEAST_M: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Stop:
    """Where the way is interrupted, as length along it, and for how long; the end for ever."""

    at_m: float
    for_s: float


class Route:
    """A line of straight pieces to walk along.

    Args:
        points: corners (x, y) in odom, at least one.
        stops: where to stop on the way, in order.

    Attributes:
        length_m: of the whole way.
        stops: the given ones, then the end.
    """

    def __init__(self, points: list[tuple[float, float]], stops: list[Stop]) -> None:
        self._points = points[:1]
        self._marks = [0.0]
        for point in points[1:]:
            piece = math.dist(point, self._points[-1])
            if piece > _LEAST_M:
                self._points.append(point)
                self._marks.append(self._marks[-1] + piece)
        self.length_m = self._marks[-1]
        on_the_way = [stop for stop in stops if stop.at_m < self.length_m]
        self.stops = (*on_the_way, Stop(self.length_m, math.inf))

    @classmethod
    def of(cls, spec: PersonSpec) -> Route:
        """The way of a person, back to the start if the person turns back."""
        points = [(point.x_m, point.y_m) for point in spec.route]
        stops = [Stop(pause.at_m, pause.for_s) for pause in spec.pauses]
        turn_m = spec.turns_back_at_m
        way = cls(points, [])
        if turn_m is not None and turn_m < way.length_m:
            there = bisect.bisect_left(way._marks, turn_m)
            out = [*way._points[:there], way.at(turn_m)]
            points = [*out, *out[-2::-1]]
            stops.append(Stop(turn_m, _ABOUT_TURN_S))
        return cls(points, sorted(stops, key=lambda stop: stop.at_m))

    @property
    def start(self) -> tuple[float, float]:
        """Where the way begins."""
        return self._points[0]

    @property
    def pieces(self) -> list[tuple[tuple[float, float], tuple[float, float]]]:
        """The straight pieces."""
        return list(itertools.pairwise(self._points))

    def at(self, along_m: float) -> tuple[float, float]:
        """The point so far along the way, within its ends."""
        piece = self._piece(along_m)
        (ax, ay), mark = self._points[piece], self._marks[piece]
        if piece + 1 == len(self._points):
            return ax, ay
        bx, by = self._points[piece + 1]
        share = min(max((along_m - mark) / (self._marks[piece + 1] - mark), 0.0), 1.0)
        return ax + share * (bx - ax), ay + share * (by - ay)

    def direction(self, along_m: float) -> tuple[float, float]:
        """Unit vector of the piece there; (1, 0) for a way of one point."""
        piece = min(self._piece(along_m), len(self._points) - 2)
        if piece < 0:
            return 1.0, 0.0
        (ax, ay), (bx, by) = self._points[piece], self._points[piece + 1]
        length = self._marks[piece + 1] - self._marks[piece]
        return (bx - ax) / length, (by - ay) / length

    def progress(self, along_m: float, x_m: float, y_m: float, limit_m: float) -> float:
        """How far along somebody at (x, y) is who was at ``along_m``: never back.

        Of the piece that this is on and the next one, the nearer counts; never beyond ``limit_m``.
        """
        here = self._piece(along_m)
        best_m, nearest = along_m, math.inf
        for piece in (here, here + 1):
            if piece + 1 >= len(self._points) or self._marks[piece] > limit_m:
                break
            (ax, ay), (bx, by) = self._points[piece], self._points[piece + 1]
            length = self._marks[piece + 1] - self._marks[piece]
            ux, uy = (bx - ax) / length, (by - ay) / length
            on = min(max((x_m - ax) * ux + (y_m - ay) * uy, 0.0), length)
            away = math.hypot(x_m - ax - on * ux, y_m - ay - on * uy)
            if away < nearest - 1e-9:
                best_m, nearest = self._marks[piece] + on, away
        return min(max(best_m, along_m), limit_m)

    def _piece(self, along_m: float) -> int:
        return max(bisect.bisect_right(self._marks, along_m) - 1, 0)
