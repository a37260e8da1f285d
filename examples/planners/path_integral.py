"""A path-integral planner (MPPI, Williams et al. 2016) in NumPy, to copy and change.

It draws a few hundred plans around the last one and averages them, the faster ones with more
weight. With the speed field, the time of a plan is the time that people leave the robot along it.
Without it, people are circles that cost.
"""

from __future__ import annotations

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from nav_adapter.exporters import people_cost, time_cost
from nav_adapter.motion import clip_twists
from perception.arrays import FloatArray

from ._shared import gap_to_boxes_m, no_boxes, obeying

_SAMPLES, _STEPS, _STEP_S = 256, 20, 0.2
# Standard deviation of the samples, and the number of steps for which a deviation lasts.
_SPREAD = np.array([0.35, 0.45])
_LASTS_STEPS = 5
# Seconds by which a plan may be slower for its weight to fall to 1/e.
_TEMPERATURE_S = 0.15
_TURNING_S = 0.15
_IN_A_WALL_S = 100.0
_NEAR_A_WALL_S = 1.0
_NEAR_A_PERSON_S = 0.2
_NEAR_M = 0.3


class PathIntegral:
    """A planner for a differential drive that averages random plans.

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
        self._plan = np.zeros((_STEPS, 2))  # speeds and yaw rates
        self._shifted_s = 0.0

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return speed (m/s) and yaw rate (rad/s)."""
        self._shift(dt_s)
        twists = self._samples(constraints, robot_state, goal_odom_m)
        positions, headings = self._roll_out(robot_state, twists)
        cost = self._seconds(constraints, positions, headings, goal_odom_m)
        cost += _TURNING_S * np.abs(twists[..., 1]).mean(axis=1)
        weight = np.exp((cost.min() - cost) / _TEMPERATURE_S)
        self._plan = np.tensordot(weight / weight.sum(), twists, axes=1)
        speed, yaw_rate = self._plan[0].tolist()
        return obeying(
            constraints,
            robot_state,
            (speed, yaw_rate),
            dt_s,
            use_speed_field=self._use_speed_field,
        )

    def _samples(
        self, constraints: NavConstraints, state: RobotState, goal_odom_m: FloatArray
    ) -> FloatArray:
        """Return (K, T, 2) speeds and yaw rates around the last plan, and that plan itself."""
        robot = self._robot
        knots = self._rng.standard_normal((_SAMPLES, -(-_STEPS // _LASTS_STEPS), 2))
        noise = _SPREAD * np.repeat(knots, _LASTS_STEPS, axis=1)[:, :_STEPS]
        noise[0] = 0.0
        twists = self._plan + noise
        top_mps = robot.max_speed_mps if self._use_speed_field else constraints.speed_limit_mps
        goal_m = float(np.hypot(*(goal_odom_m - state.position_odom_m)))
        top_mps = min(top_mps, np.sqrt(robot.max_deceleration_mps2 * goal_m))
        twists[..., 0] = np.clip(twists[..., 0], 0.0, top_mps)
        twists[..., 1] = np.clip(twists[..., 1], -1.2, 1.2)
        return twists if self._use_speed_field else clip_twists(constraints, twists)

    def _roll_out(
        self, state: RobotState, twists: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return positions (K, T + 1, 2) and headings (K, T + 1), beginning now."""
        turned = np.cumsum(twists[..., 1] * _STEP_S, axis=1)
        turned = np.concatenate([np.zeros_like(turned[:, :1]), turned], axis=1)
        headings = state.heading_odom_rad + turned
        middle = 0.5 * (headings[:, 1:] + headings[:, :-1])
        steps = twists[..., :1] * _STEP_S * np.stack([np.cos(middle), np.sin(middle)], axis=-1)
        moved = np.concatenate([np.zeros_like(steps[:, :1]), np.cumsum(steps, axis=1)], axis=1)
        return state.position_odom_m + moved, headings

    def _seconds(
        self,
        constraints: NavConstraints,
        positions: FloatArray,
        headings: FloatArray,
        goal_odom_m: FloatArray,
    ) -> FloatArray:
        """Return (K,), the time to the goal of each sample, with what its place costs."""
        robot = self._robot
        seconds = np.full(len(positions), _STEPS * _STEP_S)
        if self._use_speed_field:
            allowed = time_cost(constraints, positions, headings, dt_s=_STEP_S)
            seconds = np.maximum(seconds, allowed)
        else:
            seconds += _NEAR_A_PERSON_S * people_cost(
                constraints,
                positions,
                _STEP_S,
                robot_radius_m=robot.circumscribed_radius_m,
                inside_cost=5.0,
            ).mean(axis=1)
        seconds += np.hypot(*(goal_odom_m - positions[:, -1]).T) / robot.max_speed_mps
        gap = gap_to_boxes_m(positions, self._boxes) - robot.circumscribed_radius_m
        seconds += _IN_A_WALL_S * (gap < 0.0).mean(axis=1)
        return np.asarray(
            seconds + _NEAR_A_WALL_S * np.clip(1.0 - gap / _NEAR_M, 0.0, 1.0).mean(axis=1)
        )

    def _shift(self, dt_s: float) -> None:
        """Move the plan on by the time that has passed."""
        self._shifted_s += dt_s
        if self._shifted_s >= _STEP_S - 1e-9:
            self._shifted_s -= _STEP_S
            self._plan = np.vstack([self._plan[1:], self._plan[-1:]])
