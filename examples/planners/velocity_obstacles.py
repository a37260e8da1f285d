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

with contextlib.redirect_stdout(io.StringIO()):  # it reports missing windowing systems
    from irsim.lib.behavior.behavior_methods import DiffRVO

# Candidate velocities are slower and faster by up to this.
_WINDOW_MPS = 1.0
_SLOW_DOWN_WITHIN_M = 1.0


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
    """

    def __init__(self, robot: RobotProfile, lookahead_s: float = 4.0) -> None:
        self._robot = robot
        self._lookahead_s = lookahead_s

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
        to_goal = goal_odom_m - robot_state.position_odom_m
        distance_m = float(np.hypot(*to_goal))
        desired = to_goal * (limit_mps * min(1.0 / distance_m, 1.0 / _SLOW_DOWN_WITHIN_M))
        heading = robot_state.heading_odom_rad
        velocity = robot_state.speed_mps * np.array([math.cos(heading), math.sin(heading)])
        people = circles(constraints)
        gap_m = np.hypot(*(people[:, :2] - robot_state.position_odom_m).T) - people[:, 4]
        closing_mps = limit_mps + np.hypot(people[:, 2], people[:, 3])
        near = people[gap_m < closing_mps * self._lookahead_s]
        radius_m = self._robot.circumscribed_radius_m
        speed, yaw_rate = DiffRVO(
            [*robot_state.position_odom_m, *velocity, radius_m, *desired, heading],
            near.tolist(),
            vxmax=limit_mps,
            vymax=limit_mps,
            acce=_WINDOW_MPS,
            mode="vo",
            neighbor_threshold=math.inf,
        ).ravel()
        return float(np.clip(speed, 0.0, limit_mps)), float(yaw_rate)
