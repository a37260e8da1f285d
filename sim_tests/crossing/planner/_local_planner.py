"""The interface of a local planner, and the planner that drives straight on."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Final, Protocol, runtime_checkable

from nav_adapter import NavConstraints, RobotState
from perception.arrays import FloatArray

from ._sampling import GOAL_TOLERANCE_M

if TYPE_CHECKING:
    from tracking import PersonTrack

    from .._stage import Stage

# A planner that stops at the goal brakes at this rate.
_GENTLE_MPS2: Final = 0.5


@runtime_checkable
class LocalPlanner(Protocol):
    """Anything that drives a robot to a goal within the adapter's constraints."""

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, ...]:
        """Return ``(speed_mps, yaw_rate_radps)`` for the next ``dt_s``; the goal is (2,).

        For a robot that can move sideways it may return ``(forward_mps, left_mps,
        yaw_rate_radps)``.
        """
        ...


@runtime_checkable
class SeatedPlanner(LocalPlanner, Protocol):
    """A planner that sees the crossing with sensors of its own, and drives in real time.

    Attributes:
        late_s: how much later than its time the last control cycle began.
    """

    late_s: float

    def told(
        self, constraints: NavConstraints, tracks: tuple[PersonTrack, ...]
    ) -> tuple[NavConstraints, tuple[PersonTrack, ...]]:
        """Return the constraints that it is given, and their tracks, from those of the policy."""
        ...

    def seated(self, stage: Stage) -> AbstractContextManager[None]:
        """Return the time in which it has the robot of a stage."""
        ...


class StraightOn:
    """A planner that drives straight ahead at one speed: the robot of the paper's encounter.

    It reads neither the people nor the speed limit.

    Args:
        speed_mps: > 0.
        stops_at_goal: brake before the goal and stand there, if it lies straight ahead; without it
            the robot drives on.
    """

    def __init__(self, speed_mps: float, *, stops_at_goal: bool = False) -> None:
        self._speed_mps = speed_mps
        self._stops_at_goal = stops_at_goal

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return the same speed, or the one that can still stop at the goal, and no turn."""
        if not self._stops_at_goal:
            return self._speed_mps, 0.0
        left_m = math.dist(robot_state.position_odom_m, goal_odom_m) - GOAL_TOLERANCE_M
        stopping_mps = math.sqrt(2.0 * _GENTLE_MPS2 * max(left_m, 0.0))
        return min(self._speed_mps, stopping_mps), 0.0
