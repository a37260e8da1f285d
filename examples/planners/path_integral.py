"""A path-integral planner (MPPI, Williams et al. 2016) in NumPy, to copy and change.

It draws a few hundred ways around the last one and averages them, the faster ones with more
weight. With the speed field, a way takes the time that people leave the robot along it. Without
it, circles cost time. The speed is the limit: a sample is a way, not a speed.
"""

from __future__ import annotations

import math

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from nav_adapter.exporters import time_cost
from perception.arrays import FloatArray

from ._shared import (
    bearing_rad,
    circle_costs,
    follow_curvature,
    free_length_m,
    gap_to_boxes_m,
    no_boxes,
    obeying,
    speed_to_stop_at_mps,
    wall_shares,
)

_SAMPLES, _STEPS, _STEP_M = 200, 24, 0.2
# Standard deviation of the curvature in 1/m, and the number of steps for which a draw lasts.
_SPREAD_1PM, _LASTS_STEPS = 0.35, 6
_SHARPEST_1PM = 1.5
_FASTEST_TURN_RADPS = 0.8
# Seconds by which a way may be slower for its weight to fall to 1/e.
_TEMPERATURE_S = 0.15
_TURN_BACK_RAD = 1.6
_TURN_RADPS = 0.8
# People move while the robot is under way, at least this fast.
_SLOWEST_PACE_MPS = 0.3
# Seconds that a way costs for a curvature of 1/m, near a wall, in one, and in a circle.
_BEND_S, _NEAR_A_WALL_S, _IN_A_WALL_S, _IN_A_CIRCLE_S = 0.5, 0.5, 20.0, 20.0


class PathIntegral:
    """A planner for a differential drive that averages random ways.

    Args:
        robot: footprint and limits.
        static_boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max of racks and walls, None for none.
        use_speed_field: plan with the limit at each place, not only with the present one.
        seed: of the samples.
    """

    def __init__(
        self,
        robot: RobotProfile,
        static_boxes_odom_m: FloatArray | None = None,
        *,
        use_speed_field: bool = True,
        seed: int = 0,
    ) -> None:
        self._robot = robot
        self._boxes = no_boxes(static_boxes_odom_m)
        self._use_speed_field = use_speed_field
        self._rng = np.random.default_rng(seed)
        self._curvatures = np.zeros(_STEPS)
        self._driven_m = 0.0

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return speed (m/s) and yaw rate (rad/s)."""
        self._move_on(robot_state.speed_mps * dt_s)
        goal_m = float(np.hypot(*(goal_odom_m - robot_state.position_odom_m)))
        off_rad = bearing_rad(robot_state, goal_odom_m)
        if abs(off_rad) > _TURN_BACK_RAD:
            twist = (0.0, math.copysign(_TURN_RADPS, off_rad))
        else:
            samples = self._samples(off_rad)
            seconds = self._seconds(constraints, robot_state, samples, goal_odom_m, goal_m)
            weight = np.exp((seconds.min() - seconds) / _TEMPERATURE_S)
            self._curvatures = weight @ samples / weight.sum()
            speed = min(constraints.speed_limit_mps, self._clear_mps(robot_state, goal_m))
            twist = (speed, speed * float(self._curvatures[0]))
            if speed <= 0.0 < constraints.speed_limit_mps:  # the way ends at a wall
                twist = (0.0, math.copysign(_TURN_RADPS, off_rad))
        return obeying(constraints, robot_state, twist, dt_s)

    def _samples(self, off_rad: float) -> FloatArray:
        """Return (K, T) curvatures: half around the way to the goal, half around the last way."""
        draws = self._rng.standard_normal((_SAMPLES, _STEPS // _LASTS_STEPS))
        around = np.tile(self._curvatures, (_SAMPLES, 1))
        around[::2] = 0.0
        around[::2, :_LASTS_STEPS] = off_rad / (_LASTS_STEPS * _STEP_M)
        draws[:2] = 0.0  # the two ways themselves
        samples = around + _SPREAD_1PM * np.repeat(draws, _LASTS_STEPS, axis=1)
        return np.clip(samples, -_SHARPEST_1PM, _SHARPEST_1PM)

    def _seconds(
        self,
        constraints: NavConstraints,
        state: RobotState,
        samples: FloatArray,
        goal_odom_m: FloatArray,
        goal_m: float,
    ) -> FloatArray:
        """Return (K,), the time to the goal on each way, with what its place costs."""
        robot = self._robot
        step_m = min(_STEP_M, goal_m / _STEPS)
        positions, headings = follow_curvature(state, samples, step_m)
        pace_mps = max(constraints.speed_limit_mps, _SLOWEST_PACE_MPS)
        dt_s = step_m / pace_mps
        if self._use_speed_field:
            seconds = time_cost(constraints, positions, headings, dt_s=dt_s)
        else:
            circles = circle_costs(constraints, positions, dt_s, robot.circumscribed_radius_m)
            seconds = _STEPS * dt_s + _IN_A_CIRCLE_S * circles
        seconds += np.hypot(*(goal_odom_m - positions[:, -1]).T) / robot.max_speed_mps
        gap = gap_to_boxes_m(positions, self._boxes) - robot.circumscribed_radius_m
        near, hit = wall_shares(gap)
        seconds += _IN_A_WALL_S * hit
        seconds += _NEAR_A_WALL_S * near
        return np.asarray(seconds + _BEND_S * np.abs(samples).mean(axis=1))

    def _clear_mps(self, state: RobotState, goal_m: float) -> float:
        """Return the speed from which the robot stops on its way before a wall or the goal."""
        positions, _ = follow_curvature(state, self._curvatures[None], _STEP_M)
        gaps = gap_to_boxes_m(positions, self._boxes) - self._robot.circumscribed_radius_m
        clear_m = float(free_length_m(gaps, _STEP_M)[0])
        sharp_mps = _FASTEST_TURN_RADPS / max(abs(float(self._curvatures[0])), 1e-6)
        return min(speed_to_stop_at_mps(self._robot, min(clear_m, goal_m)), sharp_mps)

    def _move_on(self, driven_m: float) -> None:
        """Take off the last way what the robot has driven since."""
        self._driven_m += driven_m
        if self._driven_m >= _STEP_M:
            self._driven_m -= _STEP_M
            self._curvatures = np.append(self._curvatures[1:], 0.0)
