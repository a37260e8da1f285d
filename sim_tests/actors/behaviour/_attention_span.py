"""A person's attention to the robot after the first look at it: it may lapse or end."""

from __future__ import annotations

import math

from ._person import RobotBody
from ._route import DesiredVelocity, RouteFollower
from ._spec import Lapse


class AttentionSpan:
    """Tells whether a person stands and looks, or has forgotten the robot.

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

    def sees(self, t_s: float, noticed_s: float | None, touched: bool, visible: bool) -> bool:
        """Update the attention; return whether the person may look at the robot.

        Args:
            t_s: now.
            noticed_s: time of the first look at the robot; None before.
            touched: whether the robot has touched the person, who then remembers it.
            visible: whether the robot is in the field of view with a free line of sight.
        """
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

    def known(self, robot: RobotBody | None) -> RobotBody | None:
        """Return the robot as the person reacts to it: None once it is forgotten."""
        return None if self.lapsed else robot

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
