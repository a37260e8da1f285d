"""Observations and commands of learned policies, and a local planner made of one."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.arrays import FloatArray, finite_array

from ..actors.robot import NOVA_CARTER
from ..world.errors import SimError

Observation = dict[str, NDArray[Any]]

#: No boxes at all, (0, 4).
NO_BOXES: Final = np.zeros((0, 4))
NO_BOXES.setflags(write=False)
# Bounds of the observed numbers; larger ones are clipped to them.
_FAR_M: Final = 100.0
_FAST: Final = 10.0
#: Range of the scan.
SCAN_RANGE_M: Final = 10.0
# Smallest component of a ray's direction, so that nothing is divided by 0.
_TINY: Final = 1e-12


class ObservationEncoder:
    """Turns robot state, goal and constraints into arrays of fixed shapes (float32, SI units).

    All positions and velocities are in the robot's base frame (x forward, y left); velocities are
    those over the floor. Each array is new in every call:

    - ``robot`` (4,): speed (m/s), yaw rate (rad/s), speed limit (m/s), and the largest yaw rate
      (rad/s) that the limit allows at the present speed.
    - ``goal`` (2,): position of the goal.
    - ``people`` (slots, 6): position (m), velocity (m/s), radius of the obstacle (m) and lower
      bound of α of the nearest people, the nearest first; 0 in empty slots.
    - ``mask`` (slots,) int8: 1 for a slot with a person.
    - ``scan`` (rays,): distance to the nearest box in directions counter-clockwise from straight
      ahead, at most 10 m. Only with ``scan_rays`` > 0.

    Args:
        people_slots: number of people that fit, > 0.
        scan_rays: number of rays of the scan, ≥ 0.
        static_boxes_odom_m: (N, 4) boxes of the scan: x_min, y_min, x_max, y_max.

    Raises:
        SimError: for numbers that are not valid.
    """

    def __init__(
        self, people_slots: int = 8, scan_rays: int = 0, static_boxes_odom_m: Any = NO_BOXES
    ) -> None:
        if people_slots < 1 or scan_rays < 0:
            raise SimError(
                f"people_slots must be at least 1 and scan_rays at least 0, got {people_slots} and "
                f"{scan_rays}"
            )
        self.people_slots = people_slots
        self.scan_rays = scan_rays
        self._boxes: FloatArray = finite_array(
            "static_boxes_odom_m", static_boxes_odom_m, ("N", 4), SimError
        )
        self._angles = np.arange(scan_rays) * (2.0 * math.pi / max(scan_rays, 1))

    def bounds(self) -> dict[str, tuple[NDArray[np.float32], NDArray[np.float32]]]:
        """Return the lowest and highest value of each array but ``mask``."""
        person = np.array([_FAR_M, _FAR_M, _FAST, _FAST, _FAST, 1.0], np.float32)
        low = person * np.array([-1, -1, -1, -1, 0, 0], np.float32)
        robot = np.full(4, _FAST, np.float32)
        goal = np.full(2, _FAR_M, np.float32)
        bounds = {
            "robot": (robot * np.array([-1, -1, 0, 0], np.float32), robot),
            "goal": (-goal, goal),
            "people": (
                np.tile(low, (self.people_slots, 1)),
                np.tile(person, (self.people_slots, 1)),
            ),
        }
        if self.scan_rays:
            scan = np.full(self.scan_rays, SCAN_RANGE_M, np.float32)
            bounds["scan"] = (np.zeros_like(scan), scan)
        return bounds

    def encode(
        self, robot_state: RobotState, goal_odom_m: FloatArray, constraints: NavConstraints
    ) -> Observation:
        """Return the observation of a control cycle."""
        speed, yaw_rate = robot_state.speed_mps, robot_state.yaw_rate_radps
        x, y = robot_state.position_odom_m.tolist()
        c, s = math.cos(robot_state.heading_odom_rad), math.sin(robot_state.heading_odom_rad)
        robot = (
            _clipped(speed, _FAST),
            _clipped(yaw_rate, _FAST),
            min(constraints.speed_limit_mps, _FAST),
            min(constraints.yaw_rate_limit_radps(speed), _FAST),
        )
        goal_x, goal_y = goal_odom_m.tolist()
        ahead, left = goal_x - x, goal_y - y
        goal = _clipped(c * ahead + s * left, _FAR_M), _clipped(c * left - s * ahead, _FAR_M)
        rows = []
        for obstacle in constraints.obstacles:
            ahead, left = obstacle.center_odom_m.tolist()
            ahead, left = ahead - x, left - y
            vx, vy = obstacle.velocity_odom_mps.tolist()
            rows.append(
                (
                    _clipped(c * ahead + s * left, _FAR_M),
                    _clipped(c * left - s * ahead, _FAR_M),
                    _clipped(c * vx + s * vy, _FAST),
                    _clipped(c * vy - s * vx, _FAST),
                    min(obstacle.radius_m, _FAST),
                    obstacle.awareness_lower,
                )
            )
        rows.sort(key=lambda row: row[0] * row[0] + row[1] * row[1])
        count = min(len(rows), self.people_slots)
        people = np.zeros((self.people_slots, 6), np.float32)
        mask = np.zeros(self.people_slots, np.int8)
        if count:
            people[:count] = rows[:count]
            mask[:count] = 1
        observation: Observation = {
            "robot": np.array(robot, np.float32),
            "goal": np.array(goal, np.float32),
            "people": people,
            "mask": mask,
        }
        if self.scan_rays:
            scan = self._scan_m(x, y, robot_state.heading_odom_rad)
            observation["scan"] = scan.astype(np.float32)
        return observation

    def _scan_m(self, x: float, y: float, heading_rad: float) -> FloatArray:
        """Return (rays,) the distance to the nearest box; 0 within one."""
        angles = self._angles + heading_rad
        along = np.stack([np.cos(angles), np.sin(angles)], axis=1)[:, None]
        along = np.where(np.abs(along) < _TINY, _TINY, along)
        first = (self._boxes[:, :2] - (x, y)) / along
        second = (self._boxes[:, 2:] - (x, y)) / along
        enter = np.minimum(first, second).max(axis=2)
        leave = np.maximum(first, second).min(axis=2)
        hit = (enter <= leave) & (leave >= 0.0)
        reach = np.where(hit, np.maximum(enter, 0.0), SCAN_RANGE_M)
        return np.asarray(reach.min(axis=1, initial=SCAN_RANGE_M))


def _clipped(value: float, most: float) -> float:
    return min(max(value, -most), most)


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
        return (min(max(speed, -1.0), 1.0) * speed_limit, min(max(yaw_rate, -1.0), 1.0) * yaw_limit)
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
