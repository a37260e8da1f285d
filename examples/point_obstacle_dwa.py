"""A dynamic-window planner with one robot radius and point obstacles, as many small ones have.

The integration is one line that converts people to points, and one that reads the speed limit.
Such a planner enumerates the speeds that it reaches in one cycle, v − a·dt to v + a·dt. A limit
below that window leaves it without a candidate, and a robot at full speed then gets the command 0.
It therefore reads ``reachable_speed_limit_mps``, which full braking can follow.
"""

from __future__ import annotations

import math

import numpy as np
from crossing_person import (
    DT_S,
    GOAL_ODOM_M,
    MAX_YAW_RATE_RADPS,
    ROBOT,
    ROBOT_RADIUS_M,
    drive,
)

from nav_adapter import NavConstraints, RobotState, points

_HORIZON_S = 2.5
_COMFORT_M = 0.3


def plan(state: RobotState, constraints: NavConstraints) -> tuple[float, float]:
    """Return speed and yaw rate of the cheapest arc."""
    obstacles = points(constraints, spacing_m=0.1)
    limit_mps = constraints.reachable_speed_limit_mps

    rise, fall = ROBOT.max_acceleration_mps2 * DT_S, ROBOT.max_deceleration_mps2 * DT_S
    low, high = max(state.speed_mps - fall, 0.0), min(state.speed_mps + rise, limit_mps)
    speeds = np.linspace(low, max(high, low), 5)
    yaw_rates = np.linspace(-MAX_YAW_RATE_RADPS, MAX_YAW_RATE_RADPS, 31)
    v, w = (grid.ravel() for grid in np.meshgrid(speeds, yaw_rates))
    times = np.arange(DT_S, _HORIZON_S + DT_S, 2 * DT_S)
    heading = state.heading_odom_rad + w[:, None] * times
    steps = 2 * DT_S * v[:, None, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    arcs = state.position_odom_m + np.cumsum(steps, axis=1)

    cost = np.hypot(*np.moveaxis(GOAL_ODOM_M - arcs, -1, 0)).min(axis=1)
    cost += 0.1 * np.abs(w) - 0.3 * v
    if len(obstacles):
        apart = np.hypot(*np.moveaxis(arcs[:, :, None] - obstacles, -1, 0))
        gap_m = apart.min(axis=(1, 2)) - ROBOT_RADIUS_M
        cost += np.where(gap_m > 0.0, 2.0 * np.maximum(_COMFORT_M - gap_m, 0.0), math.inf)
    if not np.isfinite(cost).any():
        return 0.0, 0.0  # every arc hits a person: brake
    best = int(cost.argmin())
    return float(v[best]), float(w[best])


if __name__ == "__main__":
    drive(plan)
