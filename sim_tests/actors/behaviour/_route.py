"""Routes with stops, and the velocity that leads a person along one."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass
from typing import Final

from ._spec import PersonSpec

#: A slower person counts as standing.
STANDING_BELOW_MPS: Final = 0.15

# Duration of the stop at which a person turns back.
_ABOUT_TURN_S: Final = 0.4
# A shorter piece of a route is left out.
_MIN_PIECE_M: Final = 1e-6
# A person heads for the point of the route this far ahead, and brakes for a stop this hard.
_LOOK_AHEAD_M: Final = 1.2
_BRAKING_MPS2: Final = 0.9
_APPROACH_HZ: Final = 2.5
# A stop is reached within this length of route; the end also needs this distance.
_REACHED_M: Final = 0.1
_END_REACHED_M: Final = 0.5
# A standing person who was pushed farther away walks back to the place.
_PUSHED_AWAY_M: Final = 0.15
_NOT_SETTLED_M: Final = 1e-3
_RETURN_MPS: Final = 0.4


@dataclass(frozen=True, slots=True)
class DesiredVelocity:
    """A desired direction, as a unit vector in odom, and a desired speed."""

    ux: float
    uy: float
    speed_mps: float


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop after a length of route, its duration and heading; the last stop has no end."""

    at_m: float
    for_s: float
    heading_rad: float | None = None


class Route:
    """A line of straight pieces to walk along.

    Attributes:
        length_m: length of the whole route.
        stops: the given stops, then the end.
    """

    def __init__(
        self,
        points: list[tuple[float, float]],
        stops: list[Stop],
        end_heading_rad: float | None = None,
    ) -> None:
        self._points = points[:1]
        self._along_m = [0.0]  # length of the route up to each point
        for point in points[1:]:
            piece_m = math.dist(point, self._points[-1])
            if piece_m > _MIN_PIECE_M:
                self._points.append(point)
                self._along_m.append(self._along_m[-1] + piece_m)
        self.length_m = self._along_m[-1]
        on_the_way = [stop for stop in stops if stop.at_m < self.length_m]
        self.stops = (*on_the_way, Stop(self.length_m, math.inf, end_heading_rad))

    @classmethod
    def from_spec(cls, spec: PersonSpec) -> Route:
        """Make the route of a person, back to the start if the person turns back."""
        points = [(point.x_m, point.y_m) for point in spec.route]
        stops = [
            Stop(pause.at_m, pause.for_s, _radians(pause.heading_deg)) for pause in spec.pauses
        ]
        turn_m = spec.turns_back_at_m
        route = cls(points, [])
        if turn_m is not None and turn_m < route.length_m:
            passed = bisect.bisect_left(route._along_m, turn_m)
            out = [*route._points[:passed], route.point(turn_m)]
            points = [*out, *out[-2::-1]]
            stops.append(Stop(turn_m, _ABOUT_TURN_S))
        stops.sort(key=lambda stop: stop.at_m)
        return cls(points, stops, _radians(spec.end_heading_deg))

    @property
    def start(self) -> tuple[float, float]:
        """First point of the route."""
        return self._points[0]

    def point(self, along_m: float) -> tuple[float, float]:
        """Return the point after a length of route, clipped to its ends."""
        piece = self._piece(along_m)
        (ax, ay), start_m = self._points[piece], self._along_m[piece]
        if piece + 1 == len(self._points):
            return ax, ay
        bx, by = self._points[piece + 1]
        share = min(max((along_m - start_m) / (self._along_m[piece + 1] - start_m), 0.0), 1.0)
        return ax + share * (bx - ax), ay + share * (by - ay)

    def direction(self, along_m: float) -> tuple[float, float]:
        """Return the unit vector of the piece there; (1, 0) for a route of one point."""
        piece = min(self._piece(along_m), len(self._points) - 2)
        if piece < 0:
            return 1.0, 0.0
        (ax, ay), (bx, by) = self._points[piece], self._points[piece + 1]
        length = self._along_m[piece + 1] - self._along_m[piece]
        return (bx - ax) / length, (by - ay) / length

    def progress(self, along_m: float, x_m: float, y_m: float, limit_m: float) -> float:
        """Return the length of route at (x, y) for a person who was at ``along_m`` before.

        The nearer of the present and the next piece counts. The result lies between ``along_m``
        and ``limit_m``.
        """
        here = self._piece(along_m)
        best_m, nearest = along_m, math.inf
        for piece in (here, here + 1):
            if piece + 1 >= len(self._points) or self._along_m[piece] > limit_m:
                break
            (ax, ay), (bx, by) = self._points[piece], self._points[piece + 1]
            length = self._along_m[piece + 1] - self._along_m[piece]
            ux, uy = (bx - ax) / length, (by - ay) / length
            on = min(max((x_m - ax) * ux + (y_m - ay) * uy, 0.0), length)
            away = math.hypot(x_m - ax - on * ux, y_m - ay - on * uy)
            if away < nearest - 1e-9:
                best_m, nearest = self._along_m[piece] + on, away
        return min(max(best_m, along_m), limit_m)

    def _piece(self, along_m: float) -> int:
        return max(bisect.bisect_right(self._along_m, along_m) - 1, 0)


class RouteFollower:
    """Leads one person along a route with its stops.

    Attributes:
        started_s: time at which the person started; None before.
        arrived_s: time at which the end was reached; None before.
        along_m: length of the route covered so far.
        walking: whether the person is on the way, neither before the start nor at a stop.
    """

    def __init__(self, route: Route, speed_mps: float, start_s: float) -> None:
        self.route = route
        self._speed_mps, self._start_s = speed_mps, start_s
        self.along_m = 0.0
        self._next_stop = 0
        self._resumes_s: float | None = None
        self.started_s: float | None = None
        self.arrived_s: float | None = None
        self.walking = False

    @property
    def stop_heading_rad(self) -> float | None:
        """Heading of somebody who stands at a stop; None for any, and elsewhere."""
        if self.started_s is None or self.walking:
            return None
        return self.route.stops[self._next_stop].heading_rad

    def desired_velocity(self, t_s: float, x: float, y: float, speed_mps: float) -> DesiredVelocity:
        """Return the velocity along the route of a person at (x, y) with this speed."""
        self.walking = self._update(t_s, x, y, speed_mps)
        stop = self.route.stops[self._next_stop]
        if not self.walking:
            return self._stay(x, y)
        aim_x, aim_y = self.route.point(min(self.along_m + _LOOK_AHEAD_M, stop.at_m))
        dx, dy = aim_x - x, aim_y - y
        away = math.hypot(dx, dy)
        ux, uy = (dx / away, dy / away) if away > 1e-6 else self.route.direction(self.along_m)
        left_m = stop.at_m - self.along_m
        if math.isinf(stop.for_s) and left_m < _LOOK_AHEAD_M:
            left_m = max(left_m, away)  # the end point itself has to be reached
        limit = min(math.sqrt(2.0 * _BRAKING_MPS2 * left_m), _APPROACH_HZ * left_m)
        return DesiredVelocity(ux, uy, min(self._speed_mps, limit))

    def go(self, t_s: float) -> None:
        """Start or go on at ``t_s``, where the start or the end of a stop would come later."""
        self._start_s = min(self._start_s, t_s)
        if self._resumes_s is not None and self.arrived_s is None:
            self._resumes_s = min(self._resumes_s, t_s)

    def _update(self, t_s: float, x: float, y: float, speed_mps: float) -> bool:
        """Update progress, stops and times; return whether the person is walking."""
        if t_s < self._start_s - 1e-9:
            return False
        if self.started_s is None:
            self.started_s = t_s
        if self._resumes_s is not None:
            if t_s < self._resumes_s - 1e-9:
                return False
            self._resumes_s = None
            # Continue from the stop itself, also where the route turns back on itself.
            self.along_m = self.route.stops[self._next_stop].at_m
            self._next_stop += 1
        stop = self.route.stops[self._next_stop]
        self.along_m = self.route.progress(self.along_m, x, y, stop.at_m)
        if stop.at_m - self.along_m > _REACHED_M:
            return True
        last = math.isinf(stop.for_s)
        if last and math.dist(self.route.point(stop.at_m), (x, y)) > _END_REACHED_M:
            return True
        if last and self.arrived_s is None:
            self.arrived_s = t_s
        if speed_mps < STANDING_BELOW_MPS:
            self._resumes_s = t_s + stop.for_s
        return False

    def _stay(self, x: float, y: float) -> DesiredVelocity:
        settled = self.started_s is None or self._resumes_s is not None
        at_m = self.route.stops[self._next_stop].at_m if self.started_s is not None else 0.0
        stop_x, stop_y = self.route.point(at_m)
        dx, dy = stop_x - x, stop_y - y
        away = math.hypot(dx, dy)
        if away <= (_PUSHED_AWAY_M if settled else _NOT_SETTLED_M):
            return DesiredVelocity(*self.route.direction(self.along_m), 0.0)
        return DesiredVelocity(dx / away, dy / away, min(_RETURN_MPS, _APPROACH_HZ * away))


def _radians(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else math.radians(angle_deg)
