"""A path-integral planner (MPPI, Williams et al. 2016) in NumPy.

The integration is the call of ``people_cost`` and the limit that clips the samples. MPPI clips
its speeds at once, even below what the robot can brake to, so the drive ramps.
"""

from __future__ import annotations

import numpy as np
from crossing_person import DT_S, GOAL_ODOM_M, MAX_YAW_RATE_RADPS, ROBOT_RADIUS_M, drive

from nav_adapter import NavConstraints, RobotState
from nav_adapter.exporters import people_cost

_SAMPLES, _STEPS = 400, 30
_TEMPERATURE = 0.3
_SPREAD = np.array([0.3, 0.6])


class Mppi:
    """MPPI with the last plan as the mean of the next samples."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._mean = np.zeros((_STEPS, 2))  # speed, yaw rate

    def __call__(self, state: RobotState, constraints: NavConstraints) -> tuple[float, float]:
        """Return speed and yaw rate."""
        controls = self._mean + _SPREAD * self._rng.standard_normal((_SAMPLES, _STEPS, 2))
        controls[..., 0] = np.clip(controls[..., 0], 0.0, constraints.speed_limit_mps)
        controls[..., 1] = np.clip(controls[..., 1], -MAX_YAW_RATE_RADPS, MAX_YAW_RATE_RADPS)
        heading = state.heading_odom_rad + DT_S * np.cumsum(controls[..., 1], axis=1)
        direction = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        positions = state.position_odom_m + np.cumsum(DT_S * controls[..., :1] * direction, axis=1)

        cost = people_cost(
            constraints, positions, DT_S, robot_radius_m=ROBOT_RADIUS_M, first_s=DT_S
        ).sum(axis=1)
        cost += np.hypot(*np.moveaxis(GOAL_ODOM_M - positions, -1, 0)).sum(axis=1)
        cost += 0.05 * np.square(controls[..., 1]).sum(axis=1)
        weight = np.exp(-(cost - cost.min()) / _TEMPERATURE)
        plan = (weight[:, None, None] * controls).sum(axis=0) / weight.sum()
        self._mean = np.vstack([plan[1:], plan[-1:]])
        return float(plan[0, 0]), float(plan[0, 1])


if __name__ == "__main__":
    drive(Mppi(np.random.default_rng(0)))
