"""How far a person has come on the way, and where the next step of it leads."""

from __future__ import annotations

import math
from typing import Final

from ._meeting import Intent
from ._route import Route

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
