"""Model-predictive control of the speed along a fixed path, in SciPy.

The integration is the call of ``predicted_circles``: positions of people at each step, with a
radius that grows for other things that they might do. ``examples/planners/model_predictive.py``
controls the whole robot, in do-mpc.
"""

from __future__ import annotations

import numpy as np
from crossing_person import DT_S, ROBOT, ROBOT_RADIUS_M, drive, towards_goal
from scipy.optimize import linprog

from nav_adapter import NavConstraints, RobotState
from nav_adapter.exporters import predicted_circles

_STEPS, _STEP_S = 25, 0.2
_TIMES_S = _STEP_S * np.arange(1, _STEPS + 1)


def plan(state: RobotState, constraints: NavConstraints) -> tuple[float, float]:
    """Return speed and yaw rate of the plan that goes farthest without entering a circle."""
    people = predicted_circles(constraints, _TIMES_S, growth_mps=0.05)
    distance_m, bearing_rad = towards_goal(state)
    top_mps = min(constraints.speed_limit_mps, distance_m)
    free_m = _free_distance_m(state, people)

    # The variables are the speeds of the steps; distances are their sums.
    sums = _STEP_S * np.tril(np.ones((_STEPS, _STEPS)))
    changes = np.eye(_STEPS) - np.eye(_STEPS, k=-1)
    rise, fall = ROBOT.max_acceleration_mps2 * _STEP_S, ROBOT.max_deceleration_mps2 * _STEP_S
    now = np.zeros(_STEPS)
    now[0] = state.speed_mps
    found = linprog(
        -sums.sum(axis=0),
        A_ub=np.vstack([sums, changes, -changes]),
        b_ub=np.concatenate([free_m, rise + now, fall - now]),
        # A robot above the limit may brake down to it.
        bounds=[(0.0, max(top_mps, state.speed_mps - fall * (k + 1))) for k in range(_STEPS)],
    )
    speed = float(found.x[0]) if found.success else 0.0  # no plan: brake
    step = (speed - state.speed_mps) * DT_S / _STEP_S
    return min(state.speed_mps + step, constraints.reachable_speed_limit_mps), bearing_rad


def _free_distance_m(state: RobotState, people: np.ndarray) -> np.ndarray:
    """Return the free distance (T,) along the heading at each step."""
    c, s = np.cos(state.heading_odom_rad), np.sin(state.heading_odom_rad)
    dx, dy = np.moveaxis(people[..., :2] - state.position_odom_m, -1, 0)
    ahead, aside = c * dx + s * dy, c * dy - s * dx
    reach_m = people[..., 4] + ROBOT_RADIUS_M
    blocks = (np.abs(aside) < reach_m) & (ahead > 0.0)
    start = ahead - np.sqrt(np.maximum(reach_m**2 - aside**2, 0.0))
    free = np.where(blocks, np.maximum(start, 0.0), np.inf).min(axis=0, initial=100.0)
    return np.asarray(free)


if __name__ == "__main__":
    drive(plan)
