"""A dynamic-window planner (Fox, Burgard and Thrun 1997) in NumPy, to copy and change.

It drives a few dozen curves in its head and takes the one that is fastest to the goal. With the
speed field, the time along a curve is the time that people leave the robot there. So it takes the
wider, faster way past somebody who stands in an aisle. Without it, people are circles that cost.
"""

from __future__ import annotations

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from nav_adapter.exporters import people_cost, time_cost
from perception.arrays import FloatArray

from ._shared import brake_distance_m, gap_to_boxes_m, no_boxes, obeying

_STEP_S = 0.2
_STEPS = 20
_TURN_STEPS = 5  # a candidate turns for this long, and then goes straight
_SPEEDS = 6
_YAW_RATES_RADPS = np.array([-1.0, -0.6, -0.35, -0.2, -0.1, -0.05])
_YAW_RATES_RADPS = np.concatenate([_YAW_RATES_RADPS, [0.0], -_YAW_RATES_RADPS[::-1]])
# Seconds that a candidate pays for what it does.
_TURNING_S = 0.1
_NEAR_A_WALL_S = 1.0
_NEAR_A_PERSON_S = 0.2
_NEAR_M = 0.3


class DynamicWindow:
    """A planner for a differential drive that tries speeds and yaw rates.

    Args:
        robot: footprint and limits.
        static_boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max of racks and walls, None for none.
        use_speed_field: plan with the limit at each place, not only with the present one.
    """

    def __init__(
        self,
        robot: RobotProfile,
        static_boxes_odom_m: FloatArray | None = None,
        *,
        use_speed_field: bool = True,
    ) -> None:
        self._robot = robot
        self._boxes = no_boxes(static_boxes_odom_m)
        self._use_speed_field = use_speed_field

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return speed (m/s) and yaw rate (rad/s)."""
        robot = self._robot
        goal_m = float(np.hypot(*(goal_odom_m - robot_state.position_odom_m)))
        # With the field, a candidate may be faster later than it may be now.
        top_mps = robot.max_speed_mps if self._use_speed_field else constraints.speed_limit_mps
        top_mps = min(top_mps, np.sqrt(robot.max_deceleration_mps2 * goal_m))
        bearing_rad = self._bearing_rad(robot_state, goal_odom_m)
        turns = np.append(_YAW_RATES_RADPS, np.clip(bearing_rad / (_TURN_STEPS * _STEP_S), -1, 1))
        speeds = np.linspace(0.0, top_mps, _SPEEDS)
        speeds, turns = (grid.ravel() for grid in np.meshgrid(speeds, turns, indexing="ij"))
        positions, headings = self._roll_out(robot_state, speeds, turns)
        cost = self._seconds(constraints, positions, headings, speeds, goal_odom_m)
        cost += _TURNING_S * np.abs(turns)
        best = int(np.argmin(cost))
        if not np.isfinite(cost[best]):
            return 0.0, 0.0
        twist = (float(speeds[best]), float(turns[best]))
        return obeying(
            constraints, robot_state, twist, dt_s, use_speed_field=self._use_speed_field
        )

    def _roll_out(
        self, state: RobotState, speeds: FloatArray, turns: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return positions (K, T, 2) and headings (K, T), beginning now."""
        turning = np.minimum(np.arange(_STEPS + 1), _TURN_STEPS) * _STEP_S
        headings = state.heading_odom_rad + turns[:, None] * turning
        middle = 0.5 * (headings[:, 1:] + headings[:, :-1])
        steps = speeds[:, None, None] * _STEP_S * np.stack([np.cos(middle), np.sin(middle)], -1)
        moved = np.concatenate([np.zeros_like(steps[:, :1]), np.cumsum(steps, axis=1)], axis=1)
        return state.position_odom_m + moved, headings

    def _seconds(
        self,
        constraints: NavConstraints,
        positions: FloatArray,
        headings: FloatArray,
        speeds: FloatArray,
        goal_odom_m: FloatArray,
    ) -> FloatArray:
        """Return (K,), the time to the goal of each candidate; infinite if it cannot stop."""
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
        seconds += _NEAR_A_WALL_S * np.clip(1.0 - gap / _NEAR_M, 0.0, 1.0).mean(axis=1)
        driven = speeds[:, None] * _STEP_S * np.arange(_STEPS + 1)
        must_be_free = driven <= brake_distance_m(robot, speeds)[:, None] + 0.1
        return np.where((must_be_free & (gap < 0.0)).any(axis=1), np.inf, seconds)

    def _bearing_rad(self, state: RobotState, goal_odom_m: FloatArray) -> float:
        """Return the angle from the robot's heading to the goal, in [−π, π]."""
        x, y = goal_odom_m - state.position_odom_m
        angle = np.arctan2(y, x) - state.heading_odom_rad
        return float(np.arctan2(np.sin(angle), np.cos(angle)))
