"""A path-integral planner (MPPI, Williams et al. 2016) in NumPy.

The integration is the call of ``speed_limit_at`` for all samples at once. Each sample costs what
it drives above the limit that will hold there and then, so a sample slows in time, or goes where it
need not.
"""

from __future__ import annotations

import numpy as np
from crossing_person import DT_S, GOAL_ODOM_M, MAX_YAW_RATE_RADPS, ROBOT, drive

from nav_adapter import NavConstraints, RobotState
from nav_adapter.exporters import speed_limit_at

_SAMPLES, _STEPS, _EVERY = 400, 30, 3
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
        controls[..., 0] = np.clip(controls[..., 0], 0.0, ROBOT.max_speed_mps)
        controls[..., 1] = np.clip(controls[..., 1], -MAX_YAW_RATE_RADPS, MAX_YAW_RATE_RADPS)
        heading = state.heading_odom_rad + DT_S * np.cumsum(controls[..., 1], axis=1)
        direction = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        positions = state.position_odom_m + np.cumsum(DT_S * controls[..., :1] * direction, axis=1)

        limits = speed_limit_at(
            constraints,
            positions[:, ::_EVERY],
            heading[:, ::_EVERY],
            dt_s=_EVERY * DT_S,
            first_s=DT_S,
        )
        over = np.maximum(controls[:, ::_EVERY, 0] - limits, 0.0)
        cost = 20.0 * _EVERY * DT_S * over.sum(axis=1)
        cost += np.hypot(*np.moveaxis(GOAL_ODOM_M - positions, -1, 0)).sum(axis=1)
        cost += 0.05 * np.square(controls[..., 1]).sum(axis=1)
        weight = np.exp(-(cost - cost.min()) / _TEMPERATURE)
        plan = (weight[:, None, None] * controls).sum(axis=0) / weight.sum()
        self._mean = np.vstack([plan[1:], plan[-1:]])
        return min(float(plan[0, 0]), constraints.speed_limit_mps), float(plan[0, 1])


if __name__ == "__main__":
    drive(Mppi(np.random.default_rng(0)))
