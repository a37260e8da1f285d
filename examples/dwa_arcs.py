"""A dynamic-window planner (after Fox, Burgard and Thrun 1997) in NumPy.

The integration is one line that asks for the limit along all arcs at once, and one that reads the
speed limit. Such a planner enumerates the speeds that it reaches in one cycle, v − a·dt to v +
a·dt. A limit below that window leaves it without a candidate, and a robot at full speed then gets
the command 0. It therefore reads ``reachable_speed_limit_mps``, which full braking can follow.
"""

from __future__ import annotations

import numpy as np
from crossing_person import DT_S, GOAL_ODOM_M, MAX_YAW_RATE_RADPS, ROBOT, drive

from nav_adapter import NavConstraints, RobotState
from nav_adapter.exporters import speed_limit_at

_HORIZON_S, _STEP_S = 2.5, 0.2
_TIMES_S = np.arange(DT_S, _HORIZON_S + DT_S, _STEP_S)


def plan(state: RobotState, constraints: NavConstraints) -> tuple[float, float]:
    """Return speed and yaw rate of the cheapest arc."""
    rise, fall = ROBOT.max_acceleration_mps2 * DT_S, ROBOT.max_deceleration_mps2 * DT_S
    low = max(state.speed_mps - fall, 0.0)
    high = min(state.speed_mps + rise, constraints.reachable_speed_limit_mps)
    speeds = np.linspace(low, max(high, low), 5)
    yaw_rates = np.linspace(-MAX_YAW_RATE_RADPS, MAX_YAW_RATE_RADPS, 31)
    v, w = (grid.ravel() for grid in np.meshgrid(speeds, yaw_rates))
    heading = state.heading_odom_rad + w[:, None] * _TIMES_S
    steps = _STEP_S * v[:, None, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    arcs = state.position_odom_m + np.cumsum(steps, axis=1)

    limits = speed_limit_at(constraints, arcs, heading, dt_s=_STEP_S, first_s=DT_S)
    # Arcs that drive above the limit that will hold there and then are dear.
    cost = 3.0 * np.maximum(v[:, None] - limits, 0.0).mean(axis=1)
    cost += np.hypot(*np.moveaxis(GOAL_ODOM_M - arcs, -1, 0)).min(axis=1)
    cost += 0.1 * np.abs(w) - 0.3 * v
    best = int(cost.argmin())
    return float(v[best]), float(w[best])


if __name__ == "__main__":
    drive(plan)
