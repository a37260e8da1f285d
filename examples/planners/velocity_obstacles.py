"""ir-sim's velocity-obstacle behaviour as a local planner (``pip install ir-sim``, MIT licence).

After Fiorini and Shiller 1998: choose the collision-free velocity nearest to the desired one.
"""

from __future__ import annotations

import contextlib
import io
import math

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState, circles
from perception.arrays import FloatArray

from ._shared import direction_to_goal, no_boxes, obeying

with contextlib.redirect_stdout(io.StringIO()):  # it reports missing windowing systems
    from irsim.lib.behavior.behavior_methods import DiffRVO

# Candidate velocities are slower and faster by up to this.
_WINDOW_MPS = 1.0
_SLOW_DOWN_WITHIN_M = 1.0
_WALL_OVERSHOOT_M = 0.1
# Walls within this distance of the robot's disc count.
_WALL_WITHIN_M = 1.5


class VelocityObstaclePlanner:
    """A planner for a differential drive with velocity obstacles.

    Three properties of ir-sim's behaviour need care:

    * Its candidates are a grid of 0.05 m/s within ``acce`` of the present velocity, along x and y.
      A window of deceleration times cycle time (0.05 m/s) would be one candidate. The window is
      therefore wider, and the drive ramps.
    * ``vxmax`` and ``vymax`` bound a box, whose diagonal is 1.41 times as fast.
    * It ignores people whose centre is beyond ``neighbor_threshold``, by default 3 m.

    Args:
        robot: footprint and limits.
        lookahead_s: only people whose circle the robot could reach within this time count.
        static_boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max of racks and walls, None for none.
        use_speed_field: prefer the direction in which the fastest way begins, not that of the
            goal.
    """

    def __init__(
        self,
        robot: RobotProfile,
        lookahead_s: float = 4.0,
        *,
        static_boxes_odom_m: FloatArray | None = None,
        use_speed_field: bool = True,
    ) -> None:
        self._robot = robot
        self._lookahead_s = lookahead_s
        self._boxes = no_boxes(static_boxes_odom_m)
        self._walls = _circles_over(self._boxes)
        self._use_speed_field = use_speed_field

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return speed (m/s) and yaw rate (rad/s)."""
        limit_mps = min(constraints.speed_limit_mps, self._robot.max_speed_mps)
        if limit_mps <= 0.0:
            return 0.0, 0.0
        distance_m = float(np.hypot(*(goal_odom_m - robot_state.position_odom_m)))
        radius_m = self._robot.circumscribed_radius_m
        towards = direction_to_goal(
            constraints,
            robot_state,
            goal_odom_m,
            self._boxes,
            radius_m,
            use_speed_field=self._use_speed_field,
        )
        desired = towards * limit_mps * min(distance_m / _SLOW_DOWN_WITHIN_M, 1.0)
        heading = robot_state.heading_odom_rad
        velocity = robot_state.speed_mps * np.array([math.cos(heading), math.sin(heading)])
        people = circles(constraints)
        gap_m = np.hypot(*(people[:, :2] - robot_state.position_odom_m).T) - people[:, 4]
        closing_mps = limit_mps + np.hypot(people[:, 2], people[:, 3])
        near = people[gap_m < closing_mps * self._lookahead_s]
        apart_m = np.hypot(*(self._walls[:, :2] - robot_state.position_odom_m).T)
        apart_m -= self._walls[:, 4] + radius_m
        near = np.vstack([near, self._walls[apart_m < _WALL_WITHIN_M]])
        speed, yaw_rate = DiffRVO(
            [*robot_state.position_odom_m, *velocity, radius_m, *desired, heading],
            near.tolist(),
            vxmax=limit_mps,
            vymax=limit_mps,
            acce=_WINDOW_MPS,
            mode="vo",
            neighbor_threshold=math.inf,
        ).ravel()
        twist = (float(np.clip(speed, 0.0, limit_mps)), float(yaw_rate))
        return obeying(constraints, robot_state, twist, dt_s)


def _circles_over(boxes_odom_m: FloatArray) -> FloatArray:
    """Return (M, 5) standing circles x, y, 0, 0, radius that cover every box (N, 4).

    A box whose circle would reach farther out than the overshoot is halved, again and again: large
    circles fill the inside, and small ones line the edge.
    """
    rows = []
    for box in boxes_odom_m.tolist():
        cells = [box]
        while cells:
            x_min, y_min, x_max, y_max = cells.pop()
            x, y = 0.5 * (x_min + x_max), 0.5 * (y_min + y_max)
            radius = 0.5 * math.hypot(x_max - x_min, y_max - y_min)
            # A disc around a point of the box reaches out of it across the nearest edge.
            to_edge = min(x - box[0], box[2] - x, y - box[1], box[3] - y)
            if radius - to_edge <= _WALL_OVERSHOOT_M:
                rows.append((x, y, 0.0, 0.0, radius))
            elif x_max - x_min >= y_max - y_min:
                cells += [(x, y_min, x_max, y_max), (x_min, y_min, x, y_max)]
            else:
                cells += [(x_min, y, x_max, y_max), (x_min, y_min, x_max, y)]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)
