"""Ways out of a standstill: going on with less room, and going backward on wheels that steer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ._drives import Tick
from ._geometry import FootprintBox, Poses, follow_arcs
from ._scene import Aim, Scene

#: Largest speed of a robot that reverses.
REVERSE_MPS: Final = 0.3
# A faster robot has not come to a stop yet.
_STANDING_MPS: Final = 0.03
# The robot goes on once it has stood for this time although it might drive this fast, and goes on
# for that time.
_WAITED_S: Final = 3.0
_FAST_ENOUGH_MPS: Final = 0.2
_GOES_ON_S: Final = 3.0
# The robot reverses once no arc of this share of its turning radius is free ahead, or once it has
# stood for a while; and until a whole radius is free with a margin.
_STUCK_SHARE: Final = 0.5
_STUCK_S: Final = 1.0
_FREE_MARGIN_M: Final = 0.1
# It tries to go ahead after this time at the latest.
_LONGEST_S: Final = 8.0
_ARCS: Final = 15
_POINTS: Final = 12


class Waiting:
    """Decides when a robot that stands goes on with less room than it would like.

    Room compares yaw rates at equal speed, but maybe no curve that has it leads to a goal beside
    people who stand. Standing then costs least, for ever. Neither the limit nor the discs of people
    call for it, and both still hold when the robot goes on.
    """

    def __init__(self) -> None:
        self._stood_s = 0.0
        self._left_s = 0.0

    def goes_on(self, tick: Tick, command: Sequence[float]) -> bool:
        """Return whether the robot should go on now; it is asked once per tick, with its command.

        It waits only at a tick whose ``top_mps``, which limit, goal and giving way allow, is above
        a crawl.
        """
        self._left_s = max(self._left_s - tick.dt_s, 0.0)
        waits = _stands(tick.state.travel_mps, command) and tick.top_mps >= _FAST_ENOUGH_MPS
        self._stood_s = self._stood_s + tick.dt_s if waits else 0.0
        if self._stood_s >= _WAITED_S:
            self._stood_s, self._left_s = 0.0, _GOES_ON_S
        return self._left_s > 0.0


class Reversing:
    """Decides when a robot that steers goes backward: from when it is stuck until a way is free.

    A robot is stuck if it stands and no arc ahead is free of boxes for half of its turning radius,
    if its goal lies beside it, where no forward arc leads, or if it has stood for a second although
    nobody is in its way. It remembers that it reverses, since the first metre back would otherwise
    look like a way ahead.
    """

    def __init__(
        self,
        turning_radius_m: float,
        footprint: FootprintBox,
        clearance_m: float,
        tolerance_m: float,
    ) -> None:
        self._radius_m = turning_radius_m
        self._footprint = footprint
        self._clearance_m = clearance_m
        self._tolerance_m = tolerance_m
        self._reverses = False
        self._stood_s = 0.0
        self._reversed_s = 0.0
        length_m = self._radius_m * np.linspace(1.0 / _POINTS, 1.0, _POINTS)[:, None]
        curvature = np.linspace(-1.0, 1.0, _ARCS) / self._radius_m
        path = np.broadcast_to(length_m, (_POINTS, _ARCS))
        self._arcs = follow_arcs(path.copy(), length_m * curvature)

    def wanted(self, tick: Tick) -> bool:
        """Return whether the robot should go backward now; it is asked once per tick."""
        aim = tick.aim
        if self._reverses:
            self._reversed_s += tick.dt_s
            free_m = self._free_m(tick.scene, self._clearance_m + _FREE_MARGIN_M)
            self._reverses = self._reversed_s < _LONGEST_S and (
                self._beside(aim, 0.0) or free_m < min(self._radius_m, aim.distance_m)
            )
        elif abs(tick.state.speed_mps) <= _STANDING_MPS:
            free_m = self._free_m(tick.scene, self._clearance_m)
            if self._beside(aim, self._tolerance_m) or (
                free_m < min(_STUCK_SHARE * self._radius_m, aim.distance_m)
            ):
                self.begin()
        return self._reverses

    def begin(self) -> None:
        """Go backward from now on."""
        self._reverses, self._stood_s, self._reversed_s = True, 0.0, 0.0

    def has_stood(self, tick: Tick, command: Sequence[float]) -> bool:
        """Return whether the robot has stood for a second, with the command chosen now."""
        stands = _stands(abs(tick.state.speed_mps), command)
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
        return inside_m > self._tolerance_m + margin_m


def goal_facing(poses: Poses, aim: Aim) -> FloatArray:
    """Return by how much (V, W) each motion ends facing away from the goal, in radians."""
    x = aim.distance_m * math.cos(aim.bearing_rad) - poses.x_m[-1]
    y = aim.distance_m * math.sin(aim.bearing_rad) - poses.y_m[-1]
    c, s = poses.cos_heading[-1], poses.sin_heading[-1]
    return np.asarray(np.abs(np.arctan2(y * c - x * s, x * c + y * s)))


def _stands(speed_mps: float, command: Sequence[float]) -> bool:
    """Return whether a robot stands, and stays."""
    return max(speed_mps, abs(command[0])) <= _STANDING_MPS
