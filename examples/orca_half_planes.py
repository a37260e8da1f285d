"""ORCA in which the robot does all the avoiding: half-planes and a solver from SciPy.

The integration is the call of ``half_planes``, and the velocity that ORCA stays near to: that of
the way that the limit lets end soonest. ORCA has no acceleration limit: the velocity that it
chooses may be out of reach in one cycle, so the drive ramps.
"""

from __future__ import annotations

import math

import numpy as np
from crossing_person import ROBOT_RADIUS_M, desired_velocity, drive, follow_velocity
from scipy.optimize import minimize

from nav_adapter import NavConstraints, RobotState
from nav_adapter.exporters import half_planes


def plan(state: RobotState, constraints: NavConstraints) -> tuple[float, float]:
    """Return speed and yaw rate towards the allowed velocity nearest to the desired one."""
    heading = np.array([math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)])
    velocity = state.speed_mps * heading
    rows = half_planes(constraints, state.position_odom_m, velocity, ROBOT_RADIUS_M)
    normals, bounds = rows[:, :2], rows[:, 2]

    limit_mps = constraints.speed_limit_mps
    desired = desired_velocity(state, constraints)
    if (normals @ desired >= bounds).all():
        return follow_velocity(state, desired)
    found = minimize(
        lambda v: float(np.sum((v - desired) ** 2)),
        np.zeros(2),
        jac=lambda v: 2.0 * (v - desired),
        constraints=[
            {"type": "ineq", "fun": lambda v: normals @ v - bounds, "jac": lambda v: normals},
            {"type": "ineq", "fun": lambda v: limit_mps**2 - v @ v, "jac": lambda v: -2.0 * v},
        ],
        method="SLSQP",
    )
    # The half-planes contradict each other, or the limit: stop.
    return follow_velocity(state, found.x) if found.success else (0.0, 0.0)


if __name__ == "__main__":
    drive(plan)
