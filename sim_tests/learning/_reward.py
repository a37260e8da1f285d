"""The reward of one step, as a weighted sum."""

from __future__ import annotations

from pydantic import Field

from nav_adapter import NavConstraints

from ..world.config import SimConfig


class RewardWeights(SimConfig):
    """The weights of the reward; the reward of a step is the sum of its parts.

    Attributes:
        progress_per_m: for each metre that the goal came closer.
        goal: once, at the goal.
        time_per_s: for each second.
        over_limit_per_m: for each metre that the commanded speed exceeds the limit, summed over
            time. The speed is that of the robot's fastest point, |v| + |ω| R.
        negative_margin_per_s: for each second with a negative separation margin of a moving robot.
        contact: once for each contact that the robot caused.
    """

    progress_per_m: float = 1.0
    goal: float = Field(default=5.0)
    time_per_s: float = -0.2
    over_limit_per_m: float = -2.0
    negative_margin_per_s: float = -2.0
    contact: float = -20.0


def over_limit_mps(constraints: NavConstraints, command: tuple[float, float]) -> float:
    """Return by how much a command of speed (m/s) and yaw rate (rad/s) exceeds the limit, ≥ 0."""
    speed = abs(command[0])
    over = max(speed - constraints.speed_limit_mps, 0.0)
    fastest = constraints.fastest_point_limit_mps
    if constraints.robot is not None and fastest is not None:
        radius = constraints.robot.circumscribed_radius_m
        over = max(over, speed + abs(command[1]) * radius - fastest)
    return over
