"""The interface of a local planner, and a planner that only drives straight ahead."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from nav_adapter import NavConstraints, RobotState
from perception.arrays import FloatArray


@runtime_checkable
class LocalPlanner(Protocol):
    """Anything that drives a robot to a goal within the adapter's constraints."""

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return ``(speed_mps, yaw_rate_radps)`` for the next ``dt_s``; the goal is (2,)."""
        ...


class StraightOn:
    """A planner that drives straight ahead at one speed: the robot of the paper's encounter.

    Args:
        speed_mps: > 0.
    """

    def __init__(self, speed_mps: float) -> None:
        self._speed_mps = speed_mps

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return the same speed and no turn."""
        return self._speed_mps, 0.0
