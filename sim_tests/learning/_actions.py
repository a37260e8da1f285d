"""Actions of a learned policy as commands for the robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from nav_adapter import RobotProfile

from ..world.errors import SimError


def command_of(action: Any, robot: RobotProfile, *, normalised: bool) -> tuple[float, float]:
    """Return speed (m/s) and yaw rate (rad/s) of an action.

    Args:
        action: (2,) speed and yaw rate.
        robot: its limits are the bounds of a command; it must have a ``max_yaw_rate_radps``.
        normalised: the action is in shares of the robot's limits, clipped to [−1, 1]; else in m/s
            and rad/s, clipped to the robot's limits.

    Raises:
        SimError: for an action that is not two finite numbers.
    """
    speed_limit, yaw_limit = action_limits(robot)
    try:
        pair = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        pair = np.empty(0)
    if pair.shape != (2,) or not np.isfinite(pair).all():
        raise SimError(f"an action must be two finite numbers of shape (2,), got {action!r:.80}")
    speed, yaw_rate = pair.tolist()
    if normalised:
        return (
            min(max(speed, -1.0), 1.0) * speed_limit,
            min(max(yaw_rate, -1.0), 1.0) * yaw_limit,
        )
    return min(max(speed, -speed_limit), speed_limit), min(max(yaw_rate, -yaw_limit), yaw_limit)


def action_limits(robot: RobotProfile) -> tuple[float, float]:
    """Return the largest speed (m/s) and yaw rate (rad/s) of a command.

    Raises:
        SimError: for a profile without a largest yaw rate.
    """
    if robot.max_yaw_rate_radps is None:
        raise SimError("actions need a robot with max_yaw_rate_radps, got None")
    return robot.max_speed_mps, robot.max_yaw_rate_radps
