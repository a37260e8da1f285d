"""The way that a person means to go: corners, stops and the way back.

How far a person has come on the way, and where the next step of it leads.
"""

from __future__ import annotations

import bisect
import itertools
import math
from dataclasses import dataclass
from typing import Final

from ._meeting import Intent
from ._spec import PersonSpec

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


# How far ahead on the route one aims, how hard one brakes for a stop, what counts as there.
_AIM_M: Final = 1.2
_BRAKING_MPS2: Final = 0.9
_APPROACH_HZ: Final = 2.5
_THERE_M: Final = 0.1
_ABOUT_THERE_M: Final = 0.5
#: Slower than this counts as standing.
STILL_MPS: Final = 0.15
_PUSHED_AWAY_M: Final = 0.15
_BACK_TO_PLACE_MPS: Final = 0.4


class Errand:
    """Walking a route with its stops.

    Args:
        route: the way.
        speed_mps: free walking speed.
        start_s: when to set out.

    Attributes:
        route: as given.
        set_out_s: when the person set out; None before.
        arrived_s: when the end was reached; None before.
        going: whether the person is on the way now, neither waiting to start, at a stop nor there.
    """

    def __init__(self, route: Route, speed_mps: float, start_s: float) -> None:
        self.route = route
        self._speed_mps, self._start_s = speed_mps, start_s
        self._along_m = 0.0
        self._stop = 0
        self._resumes_s: float | None = None
        self.set_out_s: float | None = None
        self.arrived_s: float | None = None
        self.going = False

    def intent(self, t_s: float, x: float, y: float, speed_mps: float) -> Intent:
        """What somebody wants at ``t_s`` who is at (x, y) and moves so fast, with nobody around."""
        self.going = self._keep_account(t_s, x, y, speed_mps)
        stop = self.route.stops[self._stop]
        if not self.going:
            return self._staying(x, y)
        aim_x, aim_y = self.route.at(min(self._along_m + _AIM_M, stop.at_m))
        dx, dy = aim_x - x, aim_y - y
        away = math.hypot(dx, dy)
        ux, uy = (dx / away, dy / away) if away > 1e-6 else self.route.direction(self._along_m)
        left_m = stop.at_m - self._along_m
        if math.isinf(stop.for_s) and left_m < _AIM_M:
            left_m = max(left_m, away)  # the end itself has to be reached
        pace = min(math.sqrt(2.0 * _BRAKING_MPS2 * left_m), _APPROACH_HZ * left_m)
        return Intent(ux, uy, min(self._speed_mps, pace))

    def _keep_account(self, t_s: float, x: float, y: float, speed_mps: float) -> bool:
        """Whether the person is going."""
        if t_s < self._start_s - 1e-9:
            return False
        if self.set_out_s is None:
            self.set_out_s = t_s
        if self._resumes_s is not None:
            if t_s < self._resumes_s - 1e-9:
                return False
            self._resumes_s = None
            # On from the stop itself, also where the way leads back over itself.
            self._along_m = self.route.stops[self._stop].at_m
            self._stop += 1
        stop = self.route.stops[self._stop]
        self._along_m = self.route.progress(self._along_m, x, y, stop.at_m)
        if stop.at_m - self._along_m > _THERE_M:
            return True
        last = math.isinf(stop.for_s)
        if last and math.dist(self.route.at(stop.at_m), (x, y)) > _ABOUT_THERE_M:
            return True
        if last and self.arrived_s is None:
            self.arrived_s = t_s
        if speed_mps < STILL_MPS:
            self._resumes_s = t_s + stop.for_s
        return False

    def _staying(self, x: float, y: float) -> Intent:
        """To the very place of a stop; back there after having been pushed away."""
        settled = self.set_out_s is None or self._resumes_s is not None
        at_m = self.route.stops[self._stop].at_m if self.set_out_s is not None else 0.0
        there_x, there_y = self.route.at(at_m)
        dx, dy = there_x - x, there_y - y
        away = math.hypot(dx, dy)
        if away <= (_PUSHED_AWAY_M if settled else 1e-3):
            return Intent(*self.route.direction(self._along_m), 0.0)
        return Intent(dx / away, dy / away, min(_BACK_TO_PLACE_MPS, _APPROACH_HZ * away))
