"""The way out of a dead end for a robot that steers: backward."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from ._drives import Tick
from ._geometry import FootprintBox, follow_arcs
from ._sampling import CLEARANCE_M, GOAL_TOLERANCE_M
from ._scene import Aim, Scene

#: Largest speed of a robot that reverses.
REVERSE_MPS: Final = 0.3
# A faster robot has not come to a stop yet.
_STANDING_MPS: Final = 0.03
# The robot reverses once no arc of this share of its turning radius is free ahead, or once it has
# stood for a while; and until a whole radius is free with a margin.
_STUCK_SHARE: Final = 0.5
_STUCK_S: Final = 1.0
_FREE_MARGIN_M: Final = 0.1
# It tries to go ahead after this time at the latest.
_LONGEST_S: Final = 8.0
_ARCS: Final = 15
_POINTS: Final = 12


class Reversing:
    """Decides when a robot that steers goes backward: from when it is stuck until a way is free.

    A robot is stuck if it stands and no arc ahead is free of boxes for half of its turning radius,
    if its goal lies beside it, where no forward arc leads, or if it has stood for a second although
    nobody is in its way. It remembers that it reverses, since the first metre back would otherwise
    look like a way ahead.
    """

    def __init__(self, turning_radius_m: float, footprint: FootprintBox) -> None:
        self._radius_m = turning_radius_m
        self._footprint = footprint
        self._reverses, self._stood_s, self._reversed_s = False, 0.0, 0.0
        length_m = self._radius_m * np.linspace(1.0 / _POINTS, 1.0, _POINTS)[:, None]
        curvature = np.linspace(-1.0, 1.0, _ARCS) / self._radius_m
        path = np.broadcast_to(length_m, (_POINTS, _ARCS))
        self._arcs = follow_arcs(path.copy(), length_m * curvature)

    def wanted(self, tick: Tick) -> bool:
        """Return whether the robot should go backward now; it is asked once per tick."""
        aim = tick.aim
        if self._reverses:
            self._reversed_s += tick.dt_s
            free_m = self._free_m(tick.scene, CLEARANCE_M + _FREE_MARGIN_M)
            self._reverses = self._reversed_s < _LONGEST_S and (
                self._beside(aim, 0.0) or free_m < min(self._radius_m, aim.distance_m)
            )
        elif abs(tick.state.speed_mps) <= _STANDING_MPS:
            free_m = self._free_m(tick.scene, CLEARANCE_M)
            if self._beside(aim, GOAL_TOLERANCE_M) or (
                free_m < min(_STUCK_SHARE * self._radius_m, aim.distance_m)
            ):
                self.begin()
        return self._reverses

    def begin(self) -> None:
        """Go backward from now on."""
        self._reverses, self._stood_s, self._reversed_s = True, 0.0, 0.0

    def has_stood(self, tick: Tick, command: Sequence[float]) -> bool:
        """Return whether the robot has stood for a second, with the command chosen now."""
        stands = max(abs(tick.state.speed_mps), abs(command[0])) <= _STANDING_MPS
        self._stood_s = self._stood_s + tick.dt_s if stands else 0.0
        return self._stood_s >= _STUCK_S

    def _free_m(self, scene: Scene, clearance_m: float) -> float:
        """Return the length of the longest arc ahead that is free of boxes."""
        scene = scene.near(self._arcs, self._footprint.reach_m + clearance_m, 0.0)
        if not scene.boxes_odom_m:
            return self._radius_m
        gaps_m = scene.box_gap_m(self._footprint.at(self._arcs))
        free = np.logical_and.accumulate(gaps_m >= clearance_m, axis=0)
        return float(free.sum(axis=0).max()) / _POINTS * self._radius_m

    def _beside(self, aim: Aim, margin_m: float) -> bool:
        """Return whether the goal lies within one of the two tightest circles ahead."""
        x = aim.distance_m * math.cos(aim.bearing_rad)
        y = aim.distance_m * math.sin(aim.bearing_rad)
        inside_m = self._radius_m - math.hypot(x, abs(y) - self._radius_m)
        return inside_m > GOAL_TOLERANCE_M + margin_m
