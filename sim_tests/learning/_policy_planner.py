"""A local planner made of a learned policy, and the commands that actions stand for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.arrays import FloatArray

from ..actors.robot import NOVA_CARTER
from ..world.errors import SimError
from ._observations import NO_BOXES, Observation, ObservationEncoder


def command_of(action: Any, robot: RobotProfile, *, normalised: bool) -> tuple[float, float]:
    """Return speed (m/s) and yaw rate (rad/s) of an action.

    Args:
        action: (2,) speed and yaw rate.
        robot: its limits are the bounds of a command; it must have a ``max_yaw_rate_radps``.
        normalised: the action is in shares of the robot's limits, clipped to [−1, 1]; else in m/s
            and rad/s, clipped to the robot's limits.

    Raises:
        SimError: for an action that is not two finite numbers.
    """
    speed_limit, yaw_limit = action_limits(robot)
    try:
        pair = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        pair = np.empty(0)
    if pair.shape != (2,) or not np.isfinite(pair).all():
        raise SimError(f"an action must be two finite numbers of shape (2,), got {action!r:.80}")
    speed, yaw_rate = pair.tolist()
    if normalised:
        return (
            min(max(speed, -1.0), 1.0) * speed_limit,
            min(max(yaw_rate, -1.0), 1.0) * yaw_limit,
        )
    return min(max(speed, -speed_limit), speed_limit), min(max(yaw_rate, -yaw_limit), yaw_limit)


def action_limits(robot: RobotProfile) -> tuple[float, float]:
    """Return the largest speed (m/s) and yaw rate (rad/s) of a command.

    Raises:
        SimError: for a profile without a largest yaw rate.
    """
    if robot.max_yaw_rate_radps is None:
        raise SimError("actions need a robot with max_yaw_rate_radps, got None")
    return robot.max_speed_mps, robot.max_yaw_rate_radps


class PolicyPlanner:
    """Drives with a policy that was learned in the environment.

    It gives the policy the environment's observations, made of the arguments of :meth:`plan`.
    So the policy drives wherever a local planner does: in :func:`~sim_tests.run_crossing`, on the
    bench, in the test suite and on a robot.

    Args:
        policy: takes an observation, as :class:`ObservationEncoder` describes it, and returns an
            action (2,).
        robot: the robot, whose limits are the bounds of the actions.
        people_slots: as in the environment.
        scan_rays: as in the environment.
        static_boxes_odom_m: (N, 4) boxes of the scan, in the environment those of
            ``Scenario.planner_boxes_odom_m``.
        normalised_actions: as in the environment.

    Raises:
        SimError: for arguments that are not valid.
    """

    def __init__(
        self,
        policy: Callable[[Observation], Any],
        robot: RobotProfile = NOVA_CARTER,
        *,
        people_slots: int = 8,
        scan_rays: int = 0,
        static_boxes_odom_m: Any = NO_BOXES,
        normalised_actions: bool = True,
    ) -> None:
        if not callable(policy):
            raise SimError(
                f"policy must be a function from an observation to an action, got {policy!r:.80}"
            )
        self._policy = policy
        self._robot = robot
        self._encoder = ObservationEncoder(people_slots, scan_rays, static_boxes_odom_m)
        self._normalised = normalised_actions

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return ``(speed_mps, yaw_rate_radps)`` of the policy's action."""
        action = self._policy(self._encoder.encode(robot_state, goal_odom_m, constraints))
        return command_of(action, self._robot, normalised=self._normalised)
