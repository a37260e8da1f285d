"""A dynamic-window planner (after Fox, Burgard and Thrun 1997) in NumPy, to copy and change.

Each cycle it tries a few speeds on a few curves and takes the pair that is fastest to the goal.
With the speed field, a curve takes the time that people leave the robot along it. So the planner
takes the wider, faster way past somebody who stands in an aisle. Without it, circles cost time.
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
    stop_distance_m,
    wall_shares,
)

_LENGTH_M, _STEPS = 4.0, 20
# A curve bends over this many steps and is straight after it. Half of the curves bend back from
# another step on, and lead past somebody.
_TURN_STEPS, _BACK_FROM = 6, 10
# With the speed field, time also counts on this many steps straight to the goal after the curve.
_STRAIGHT_STEPS = 15
_SPEED_SHARES = (1.0, 0.7, 0.4, 0.2)
_BENDS_RAD = (0.0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.65, 0.9, 1.2)
# Farther than this from its goal's direction, the robot turns on the spot.
_TURN_BACK_RAD = 1.6
_TURN_RADPS = 0.8
# Seconds that a curve costs for a bend of 1 rad, for being near a wall, in one, or in a circle.
_BEND_S, _NEAR_A_WALL_S, _IN_A_WALL_S, _IN_A_CIRCLE_S = 0.3, 0.5, 10.0, 20.0


class DynamicWindow:
    """A planner for a differential drive that tries speeds and curves.

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
        goal_m = float(np.hypot(*(goal_odom_m - robot_state.position_odom_m)))
        off_rad = bearing_rad(robot_state, goal_odom_m)
        if abs(off_rad) > _TURN_BACK_RAD:
            twist = (0.0, math.copysign(_TURN_RADPS, off_rad))
        else:
            twist = self._best(robot_state, goal_odom_m, constraints, goal_m, off_rad)
        return obeying(constraints, robot_state, twist, dt_s)

    def _best(
        self,
        state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        goal_m: float,
        off_rad: float,
    ) -> tuple[float, float]:
        """Return the speed and yaw rate that lead to the goal in the least time."""
        step_m = min(_LENGTH_M, goal_m) / _STEPS
        bends = np.unique([*_BENDS_RAD, *(-bend for bend in _BENDS_RAD), off_rad])
        bends = np.tile(bends, 2)
        curvatures = np.zeros((len(bends), _STEPS))
        curvatures[:, :_TURN_STEPS] = bends[:, None] / (_TURN_STEPS * step_m)
        back = curvatures[len(bends) // 2 :]
        back[:, _BACK_FROM : _BACK_FROM + _TURN_STEPS] = -back[:, :_TURN_STEPS]
        positions, headings = follow_curvature(state, curvatures, step_m)
        gaps = gap_to_boxes_m(positions, self._boxes) - self._robot.circumscribed_radius_m
        free_m = free_length_m(gaps, step_m)
        fixed = self._fixed_s(positions, gaps, goal_odom_m) + _BEND_S * np.abs(bends)
        straight = self._straight_on(positions[:, -1], goal_odom_m, step_m)
        top_mps = min(
            speed_to_stop_at_mps(self._robot, goal_m), max(constraints.speed_limit_mps, 0.1)
        )
        # If every curve ends at a wall, turn on the spot.
        best_s, best = math.inf, (0.0, math.copysign(_TURN_RADPS, off_rad))
        for speed in (top_mps * share for share in _SPEED_SHARES):
            dt_s = step_m / speed
            seconds = fixed + self._under_way_s(constraints, positions, headings, dt_s)
            if self._use_speed_field:
                seconds += self._delay_s(constraints, straight, dt_s)
            seconds[free_m < stop_distance_m(self._robot, speed)] = math.inf
            index = int(np.argmin(seconds))
            if seconds[index] < best_s:
                best_s, best = seconds[index], (speed, speed * curvatures[index, 0])
        return best

    def _under_way_s(
        self,
        constraints: NavConstraints,
        positions: FloatArray,
        headings: FloatArray,
        dt_s: float,
    ) -> FloatArray:
        """Return (K,), the time along each curve among people who move on meanwhile."""
        driven_s = dt_s * _STEPS
        if self._use_speed_field:
            allowed_s = time_cost(constraints, positions, headings, dt_s=dt_s)
            return np.asarray(np.maximum(driven_s, allowed_s))
        radius_m = self._robot.circumscribed_radius_m
        circles = circle_costs(constraints, positions, dt_s, radius_m)
        return np.asarray(driven_s + _IN_A_CIRCLE_S * circles)

    def _straight_on(self, ends: FloatArray, goal_odom_m: FloatArray, step_m: float) -> FloatArray:
        """Return positions (K, S + 1, 2) that lead from the ends of the curves to the goal."""
        to_goal = goal_odom_m - ends
        far_m = np.hypot(*to_goal.T)[:, None]
        lengths_m = np.minimum(step_m * np.arange(_STRAIGHT_STEPS + 1), far_m)
        shares = lengths_m / np.maximum(far_m, 1e-9)
        return np.asarray(ends[:, None] + shares[..., None] * to_goal[:, None])

    def _delay_s(
        self, constraints: NavConstraints, straight: FloatArray, dt_s: float
    ) -> FloatArray:
        """Return (K,), the time that people cost after the curves."""
        allowed_s = time_cost(constraints, straight, dt_s=dt_s, first_s=dt_s * _STEPS)
        length_m = np.hypot(*(straight[:, -1] - straight[:, 0]).T)
        return np.asarray(allowed_s - length_m / self._robot.max_speed_mps)

    def _fixed_s(
        self, positions: FloatArray, gaps: FloatArray, goal_odom_m: FloatArray
    ) -> FloatArray:
        """Return (K,), the time from the end of each curve, and the cost of walls beside it."""
        farther_m = np.hypot(*(goal_odom_m - positions[:, -1]).T)
        near, hit = wall_shares(gaps)
        return np.asarray(
            farther_m / self._robot.max_speed_mps + _NEAR_A_WALL_S * near + _IN_A_WALL_S * hit
        )
