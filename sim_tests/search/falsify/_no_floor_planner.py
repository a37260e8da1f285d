"""The dynamic window without the adapter's floor: UNSAFE, and in the simulation only."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.arrays import FloatArray

from ...crossing.planner import ReferencePlanner

#: Suffix of the policy's name in tables.
LABEL: Final = "UNSAFE-NO-FLOOR"
#: The planner of a job, as ``module:Class``.
PLANNER: Final = f"{__package__}:NoFloorPlanner"
# Radius of every person for a planner without the floor.
_RADIUS_M: Final = 0.01


class NoFloorPlanner:
    """The dynamic window without the adapter's floor: UNSAFE, to check that a search finds it.

    The adapter has no switch for this, and must not have one. This planner ignores the adapter's
    radii and speed limits: every person is a point, and no speed-and-separation rule holds.

    Args:
        robot: as for the reference planner.
        static_boxes_odom_m: as for the reference planner.
    """

    def __init__(self, robot: RobotProfile, static_boxes_odom_m: Any = None) -> None:
        self._robot = robot
        self._planner = ReferencePlanner(robot, static_boxes_odom_m)

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, ...]:
        """Plan as :class:`~sim_tests.LocalPlanner` does, without the adapter's constraints."""
        unconstrained = replace(
            constraints,
            obstacles=tuple(replace(each, radius_m=_RADIUS_M) for each in constraints.obstacles),
            speed_limit_mps=self._robot.max_speed_mps,
            reachable_speed_limit_mps=self._robot.max_speed_mps,
            fastest_point_limit_mps=math.inf,
            speed_basis=None,  # what the planner plans with is the floor too; its window remains
        )
        return self._planner.plan(robot_state, goal_odom_m, unconstrained, dt_s)
