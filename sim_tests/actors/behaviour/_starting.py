"""The start of people who stand: by chance, when the robot is near, or once they forget it."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ._route import DesiredVelocity, RouteFollower
from ._spec import Lapse
from ._surroundings import RobotBody

#: Share of people at the kerb who start within the next second, by the time since the last look at
#: the vehicle: now, up to 1 s, up to 4 s, and longer or never. The first row was counted at all
#: vehicles and stands for a robot that yields, the second at vehicles that move or accelerate.
START_SHARES: Final = {"yielding": (0.39, 0.45, 0.25, 0.13), "moving": (0.23, 0.26, 0.09, 0.10)}
#: Ends of the first three times since the last look, s.
LOOK_WITHIN_S: Final = (0.0, 1.0, 4.0)
# People start only after they have stood for this long.
_STOOD_S: Final = 0.5
# The table counts starts in the second after a look was dated, so on average half a second later.
_HALF_SECOND_S: Final = 0.5
# A slower robot yields.
_YIELDING_MPS: Final = 0.25
# Robots farther away make nobody start.
_RANGE_M: Final = 12.0
# A robot out of sight is extrapolated for this time, then forgotten.
_REMEMBERED_S: Final = 3.0


def start_share(since_look_s: float, *, yielding: bool) -> float:
    """Return the share of people who start within a second.

    Args:
        since_look_s: time since the last look at the robot; infinite without one.
        yielding: the robot stands or creeps.
    """
    row = START_SHARES["yielding" if yielding else "moving"]
    late = sum(since_look_s > within + 1e-9 for within in LOOK_WITHIN_S)
    return row[late]


class StartingModel:
    """Decides when a person who stands starts to walk.

    Somebody who stands on the way, or waits for the robot, starts as people at the kerb do, see
    :data:`START_SHARES`. Somebody who has nowhere to go starts at a constant rate.
    """

    def __init__(self, idle_share: float, rng: np.random.Generator) -> None:
        self._idle_share, self._rng = idle_share, rng
        self._stands_since_s: float | None = None
        self._looked_s = -math.inf

    def starts(
        self,
        t_s: float,
        dt_s: float,
        *,
        standing: bool,
        idle: bool,
        looking: bool,
        place: tuple[float, float],
        robot: RobotBody | None,
    ) -> bool:
        """Return whether the person starts now."""
        if looking:
            self._looked_s = t_s
        if not standing:
            self._stands_since_s = None
            return False
        if self._stands_since_s is None:
            self._stands_since_s = t_s
        if t_s - self._stands_since_s < _STOOD_S - 1e-9 or robot is None:
            return False
        if math.dist(place, (robot.x_m, robot.y_m)) > _RANGE_M:
            return False
        share = self._idle_share
        if not idle:
            yielding = math.hypot(robot.vx_mps, robot.vy_mps) < _YIELDING_MPS
            since_look_s = max(t_s - self._looked_s - _HALF_SECOND_S, 0.0)
            share = start_share(since_look_s, yielding=yielding)
        return bool(self._rng.random() < 1.0 - (1.0 - share) ** dt_s)


class AttentionSpan:
    """Tells whether a person stands and looks, knows of the robot, or has forgotten it.

    Args:
        lapse: when and how the attention ends; None never.
        sets_off_within_m: as for :class:`PersonSpec`.
        start_s: time of the start, or the earliest one of somebody who waits for the robot.

    Attributes:
        starts_s: time of the start by the clock; infinite for somebody who waits for the robot.
        halted: the person stands because of the robot, until the lapse.
        lapsed: the person walks as if no robot were there.
    """

    def __init__(
        self, lapse: Lapse | None, sets_off_within_m: float | None = None, start_s: float = 0.0
    ) -> None:
        self._lapse, self._within_m, self._earliest_s = lapse, sets_off_within_m, start_s
        self.starts_s = start_s if sets_off_within_m is None else math.inf
        self.halted = self.lapsed = False
        self._robot: tuple[RobotBody, float] | None = None  # as last known, and its time

    def sees(self, t_s: float, noticed_s: float | None, touched: bool, visible: bool) -> bool:
        """Update the attention; return whether the person may look at the robot."""
        if self._lapse is None or noticed_s is None:
            return visible
        over = t_s - noticed_s >= self._lapse.after_look_s - 1e-9
        self.halted = self._lapse.halts and not over and not touched
        self.lapsed = over and not touched
        return visible and not (self.lapsed and self._lapse.looks_away)

    def maybe_set_off(self, follower: RouteFollower, t_s: float, robot: RobotBody | None) -> None:
        """Let a person who stands until the robot is near their way set off, and forget it."""
        if self._within_m is None or robot is None or t_s < self._earliest_s - 1e-9:
            return
        route = follower.route
        if robot.gap_to_line_m(route.start, route.direction(0.0)) <= self._within_m:
            follower.go(t_s)
            self._within_m, self._lapse = None, Lapse(after_look_s=0.0)

    def end_halt(self) -> None:
        """Let a person who halted set off now, and still know of the robot."""
        self._lapse = None
        self.halted = False

    def remember(self, robot: RobotBody, t_s: float) -> None:
        """Note the robot as the person sees or feels it now."""
        self._robot = robot, t_s

    def known(self, t_s: float) -> RobotBody | None:
        """Return the robot as the person reacts to it; None without knowledge of it."""
        if self._robot is None or self.lapsed or t_s - self._robot[1] > _REMEMBERED_S:
            return None
        return self._robot[0].extrapolated(t_s - self._robot[1])

    def lead(
        self, follower: RouteFollower, t_s: float, x: float, y: float, speed_mps: float
    ) -> DesiredVelocity:
        """Return the velocity along a route of a person at (x, y) with this speed; 0 if halted.

        Somebody who halted sets off at the lapse, whatever start and pauses say.
        """
        if self.lapsed and self._lapse is not None and self._lapse.halts:
            follower.go(t_s)
        wanted = follower.desired_velocity(t_s, x, y, speed_mps)
        return DesiredVelocity(wanted.ux, wanted.uy, 0.0) if self.halted else wanted
