"""The interface of a local planner, and planners that know less than the dynamic window."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import TYPE_CHECKING, Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.arrays import FloatArray

from ._config import PlannerConfig
from ._sampling_planner import SamplingPlanner

if TYPE_CHECKING:
    from tracking import PersonTrack

    from .._stage import Stage

# A planner that stops at the goal brakes at this rate, and stands this near to it.
_GENTLE_MPS2: Final = 0.5
_GOAL_TOLERANCE_M: Final = 0.1
# Defaults of Nav2's inflation layer (docs.nav2.org, "Inflation Layer Parameters"):
# inflation_radius 0.55 m and cost_scaling_factor 10.0. The cost of a cell is
# 252 exp(-10 (d - r)), at d from an obstacle and with r the robot's inscribed radius, and 0
# beyond 0.55 m. So it is a cost over the gap d - r between outline and obstacle.
_INFLATION_RADIUS_M: Final = 0.55
# Nav2 asks for a radius above the inscribed one; of a wider robot, one cell of the map remains.
_CELL_M: Final = 0.05
_STANDING_MPS: Final[FloatArray] = np.zeros(2)


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
        left_m = math.dist(robot_state.position_odom_m, goal_odom_m) - _GOAL_TOLERANCE_M
        stopping_mps = math.sqrt(2.0 * _GENTLE_MPS2 * max(left_m, 0.0))
        return min(self._speed_mps, stopping_mps), 0.0


class CostmapPlanner(SamplingPlanner):
    """A planner with a costmap, as most sites have: it knows places, not velocities.

    It is the :class:`SamplingPlanner` for whom every person stands, without giving way, without
    more room beside people than beside a rack, and with costs near obstacles as by the defaults of
    Nav2's inflation layer (``inflation_radius`` 0.55 m, ``cost_scaling_factor`` 10). Their
    exponential is replaced by the planner's parabola of the same width, which for a robot 0.5 m
    wide differs from it by less than 0.1 of the cost at contact. It keeps the speed limit of its
    policy.

    Args:
        robot: footprint and limits, as for :class:`SamplingPlanner`.
        static_boxes_odom_m: (N, 4) fixed obstacles x_min, y_min, x_max, y_max; None for none.

    Raises:
        SimError: if the boxes are not finite or a minimum is not below its maximum.
    """

    def __init__(self, robot: RobotProfile, static_boxes_odom_m: ArrayLike | None = None) -> None:
        inscribed_m = float(
            np.abs([robot.footprint_m.min(axis=0), robot.footprint_m.max(axis=0)]).min()
        )
        gap_m = max(_INFLATION_RADIUS_M - inscribed_m, _CELL_M)
        settings = PlannerConfig.for_robot(robot).model_dump() | {
            "person_comfort_m": gap_m,
            "static_comfort_m": gap_m,
            "give_way_s": 0.0,
            "front_weight": 0.0,
            "room_weight": 0.0,
            "keep_right_weight": 0.0,
        }
        super().__init__(robot, static_boxes_odom_m, PlannerConfig(**settings))

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: ArrayLike,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, ...]:
        """Choose the command for the next tick, as if everybody stood; see the base class."""
        people = tuple(
            replace(person, velocity_odom_mps=_STANDING_MPS) for person in constraints.obstacles
        )
        return super().plan(robot_state, goal_odom_m, replace(constraints, obstacles=people), dt_s)
