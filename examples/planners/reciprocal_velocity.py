"""ORCA's authors' library RVO2 as a local planner (``pip install pyrvo``, Apache-2.0 licence).

Van den Berg, Guy, Lin and Manocha 2011, "Reciprocal n-body collision avoidance". Walls are line
obstacles of the library. The agent is the point ahead of the wheels that can move in every
direction, and ``differential_drive`` gives it the velocity that the library chooses.
"""

from __future__ import annotations

import math

import numpy as np
import pyrvo

from nav_adapter import NavConstraints, RobotProfile, RobotState, circles
from nav_adapter.motion import control_point, differential_drive
from perception.arrays import FloatArray

from ._shared import direction_to_goal, no_boxes, obeying, speed_to_stop_at_mps

_HORIZON_S = 3.0
_WALL_HORIZON_S = 1.0
# The point moves this far ahead of the wheels.
_AHEAD_M = 0.2
_NEAR_M = 8.0
# The library has no symmetry breaking: a robot that heads for a person's middle keeps right.
_RIGHT = 0.05


class ReciprocalVelocity:
    """A planner for a differential drive that follows RVO2's velocity.

    RVO2 leaves half of the avoiding to each person. The robot does half of the rest in every
    cycle, so it avoids late but fully. Where it is too late, the speed limit stops it.

    Args:
        robot: footprint and limits.
        static_boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max of racks and walls, None for none.
        use_speed_field: prefer the direction in which the fastest way begins, not that of the
            goal.
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
        limit_mps = min(constraints.speed_limit_mps, self._robot.max_speed_mps)
        if limit_mps <= 0.0:
            return 0.0, 0.0
        radius_m = self._robot.circumscribed_radius_m
        distance_m = float(np.hypot(*(goal_odom_m - robot_state.position_odom_m)))
        towards = direction_to_goal(
            constraints,
            robot_state,
            goal_odom_m,
            self._boxes,
            radius_m,
            use_speed_field=self._use_speed_field,
        )
        right = np.array([towards[1], -towards[0]])
        speed_mps = min(limit_mps, speed_to_stop_at_mps(self._robot, distance_m))
        chosen = self._velocity(
            constraints, robot_state, speed_mps * (towards + _RIGHT * right), limit_mps, dt_s
        )
        twist = differential_drive(
            chosen, robot_state, self._robot, constraints=constraints, ahead_m=_AHEAD_M
        )
        return obeying(constraints, robot_state, twist, dt_s)

    def _velocity(
        self,
        constraints: NavConstraints,
        state: RobotState,
        wanted_mps: FloatArray,
        limit_mps: float,
        dt_s: float,
    ) -> FloatArray:
        """Return the velocity (2,) that RVO2 chooses."""
        simulator = pyrvo.RVOSimulator()
        simulator.set_time_step(dt_s)
        point, velocity = control_point(state, _AHEAD_M)
        for x_min, y_min, x_max, y_max in self._boxes.tolist():
            near = np.clip(point, [x_min, y_min], [x_max, y_max])
            if float(np.hypot(*(point - near))) < _NEAR_M:
                corners = [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)]
                simulator.add_obstacle(corners)
        simulator.process_obstacles()
        for x, y, vx, vy, radius in circles(constraints).tolist():
            agent = _agent(simulator, (x, y), radius, math.hypot(vx, vy))
            simulator.set_agent_velocity(agent, (vx, vy))
            simulator.set_agent_pref_velocity(agent, (vx, vy))
        # The disc around the point holds the whole footprint.
        corners_m = self._robot.footprint_m - [_AHEAD_M, 0.0]
        radius_m = float(np.hypot(*corners_m.T).max())
        robot = _agent(simulator, tuple(point), radius_m, limit_mps)
        simulator.set_agent_velocity(robot, tuple(velocity))
        simulator.set_agent_pref_velocity(robot, tuple(wanted_mps))
        simulator.do_step()
        chosen = simulator.get_agent_velocity(robot)
        return np.array([chosen.x, chosen.y])


def _agent(
    simulator: pyrvo.RVOSimulator,
    position: tuple[float, float],
    radius_m: float,
    max_speed_mps: float,
) -> int:
    return int(
        simulator.add_agent(
            position, 15.0, 10, _HORIZON_S, _WALL_HORIZON_S, radius_m, max_speed_mps
        )
    )
