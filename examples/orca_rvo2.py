"""The RVO2 library by ORCA's authors (``pip install pyrvo``).

The integration is one agent per person, the limit as the robot's maximum speed, and the velocity
that it prefers. The library assumes that every agent does half of the avoiding. The robot therefore
does half of the remainder in every cycle, which is late but converges. Where that is not enough,
use the half-planes (``orca_half_planes.py``), which leave nothing to the person. RVO2 does not
limit acceleration.
"""

from __future__ import annotations

import math
import sys

import numpy as np
from crossing_person import DT_S, ROBOT_RADIUS_M, desired_velocity, drive, follow_velocity

from nav_adapter import NavConstraints, RobotState, circles

try:
    import pyrvo
except ImportError:
    sys.exit("this example needs RVO2: pip install pyrvo")


def plan(state: RobotState, constraints: NavConstraints) -> tuple[float, float]:
    """Return speed and yaw rate towards the velocity that RVO2 chooses."""
    simulator = pyrvo.RVOSimulator()
    simulator.set_time_step(DT_S)
    people = circles(constraints)
    for x, y, vx, vy, radius in people:
        _agent(simulator, (x, y), (vx, vy), (vx, vy), radius, math.hypot(vx, vy))

    limit_mps = constraints.speed_limit_mps
    heading = np.array([math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)])
    desired = desired_velocity(state, constraints)
    velocity = state.speed_mps * heading
    _agent(simulator, state.position_odom_m, velocity, desired, ROBOT_RADIUS_M, limit_mps)
    simulator.do_step()
    chosen = simulator.get_agent_velocity(len(people))
    speed, yaw_rate = follow_velocity(state, np.array([chosen.x, chosen.y]))
    return min(speed, limit_mps), yaw_rate


def _agent(
    simulator: pyrvo.RVOSimulator,
    position: tuple[float, float],
    velocity: tuple[float, float],
    desired: tuple[float, float],
    radius_m: float,
    max_speed_mps: float,
) -> None:
    agent = simulator.add_agent(tuple(position), 15.0, 10, 3.0, 3.0, radius_m, max_speed_mps)
    simulator.set_agent_velocity(agent, tuple(velocity))
    simulator.set_agent_pref_velocity(agent, tuple(desired))


if __name__ == "__main__":
    drive(plan)
