"""A weakness planted on purpose: a robot whose floor was taken away. In the simulation only."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.arrays import FloatArray

from ...crossing.planner import SamplingPlanner

#: What people are to a planner without a floor.
RADIUS_M: Final = 0.01
#: What tables add to a policy's name.
LABEL: Final = "UNSAFE-NO-FLOOR"
#: As a planner of a job.
PLANNER: Final = f"{__name__}:NoFloorPlanner"


class NoFloorPlanner:
    """The reference planner without the adapter's floor: UNSAFE, to see that a search finds it.

    The adapter has no switch for this, and must not have one. This planner throws away what the
    adapter says: to it everybody is a point, and no speed and separation rule holds.

    Args:
        robot: as the reference planner.
        static_boxes_odom_m: as the reference planner.
    """

    def __init__(self, robot: RobotProfile, static_boxes_odom_m: Any = None) -> None:
        self._robot = robot
        self._planner = SamplingPlanner(robot, static_boxes_odom_m)

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """See :class:`~sim_tests.LocalPlanner`."""
        bare = replace(
            constraints,
            obstacles=tuple(replace(each, radius_m=RADIUS_M) for each in constraints.obstacles),
            speed_limit_mps=self._robot.max_speed_mps,
            reachable_speed_limit_mps=self._robot.max_speed_mps,
        )
        return self._planner.plan(robot_state, goal_odom_m, bare, dt_s)
