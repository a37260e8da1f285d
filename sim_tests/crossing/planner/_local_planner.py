"""The interface of a local planner, and a planner that only drives straight ahead."""

from __future__ import annotations

import math
from typing import Final, Protocol, runtime_checkable

from nav_adapter import NavConstraints, RobotState
from perception.arrays import FloatArray

# A planner that stops at the goal brakes at this rate, and stands this near to it.
_GENTLE_MPS2: Final = 0.5
_GOAL_TOLERANCE_M: Final = 0.1


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
        left_m = math.dist(robot_state.position_odom_m, goal_odom_m) - _GOAL_TOLERANCE_M
        stopping_mps = math.sqrt(2.0 * _GENTLE_MPS2 * max(left_m, 0.0))
        return min(self._speed_mps, stopping_mps), 0.0
