"""The conduct of a planner in one episode: its obedience to both limits, and its computing time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from ...world.errors import SimError

if TYPE_CHECKING:
    from nav_adapter import RobotProfile

    from ...crossing import CrossingFrame, CrossingResult

#: Overshoot of the wheel motors on a ramp, about; a smaller excess breaks no limit.
OVERSHOOT_MPS: Final = 0.03


@dataclass(frozen=True, slots=True)
class Conduct:
    """The conduct of a planner in one episode.

    None stands for an episode that is too short, or that has no limit of this kind.

    Attributes:
        limit_excess_mps: see :func:`limit_excess_mps`.
        fastest_point_excess_mps: see :func:`fastest_point_excess_mps`.
        plan_calls: number of calls of ``plan``.
        plan_median_s: median elapsed time of a call, by the computer's clock.
        plan_p99_s: 99th percentile of it.
        cycle_s: time between two calls in the simulation, which a call should not exceed.
    """

    limit_excess_mps: float | None
    fastest_point_excess_mps: float | None
    plan_calls: int
    plan_median_s: float
    plan_p99_s: float
    cycle_s: float

    @classmethod
    def of(cls, result: CrossingResult) -> Conduct:
        """Return the conduct of the planner of a crossing.

        Raises:
            SimError: the result has no frames.
        """
        frames = result.frames
        if not frames:
            raise SimError("a conduct needs at least one control cycle, got a result without any")
        times_s = np.array([frame.plan_s for frame in frames])
        cycle_s = frames[1].t_s - frames[0].t_s if len(frames) > 1 else 0.0
        return cls(
            limit_excess_mps(frames, result.robot),
            fastest_point_excess_mps(frames, result.robot),
            len(frames),
            float(np.median(times_s)),
            float(np.quantile(times_s, 0.99)),
            cycle_s,
        )


def limit_excess_mps(frames: Sequence[CrossingFrame], robot: RobotProfile) -> float | None:
    """Return the largest excess of the speed over the allowed one, m/s.

    The speed is that in the direction of travel, whatever the heading. Allowed is
    ``speed_limit_mps`` of the cycle before. Where the limit falls faster than the robot can brake,
    full braking from the allowed speed of the cycle before is allowed as well. So the excess of a
    robot that does not brake grows until it is the whole difference to the limit. It is negative
    for a robot that was always slower than allowed, and None for fewer than two cycles.
    """
    return _largest_excess(
        frames,
        robot,
        [frame.robot_state.travel_mps for frame in frames],
        [frame.constraints.speed_limit_mps for frame in frames],
    )


def fastest_point_excess_mps(frames: Sequence[CrossingFrame], robot: RobotProfile) -> float | None:
    """Return the largest excess of |v| + |ω| R over the allowed value, m/s.

    R is the circumscribed radius, so |v| + |ω| R bounds the speed of every point of the footprint.
    Allowed is ``fastest_point_limit_mps`` of the cycle before, with the same allowance for braking
    as in :func:`limit_excess_mps`. None if no cycle has such a limit.
    """
    radius_m = robot.circumscribed_radius_m
    states = [frame.robot_state for frame in frames]
    limits = [frame.constraints.fastest_point_limit_mps for frame in frames]
    return _largest_excess(
        frames,
        robot,
        [state.travel_mps + abs(state.yaw_rate_radps) * radius_m for state in states],
        [math.inf if limit is None else limit for limit in limits],
    )


def _largest_excess(
    frames: Sequence[CrossingFrame],
    robot: RobotProfile,
    speeds_mps: Sequence[float],
    limits_mps: Sequence[float],
) -> float | None:
    """Return the largest excess of a speed over its limit of the cycle before, or over braking."""
    allowed_mps = math.inf
    largest: float | None = None
    for before, after in itertools.pairwise(range(len(frames))):
        fall_mps = robot.max_deceleration_mps2 * (frames[after].t_s - frames[before].t_s)
        braked_mps = min(speeds_mps[before], allowed_mps) - fall_mps
        allowed_mps = max(limits_mps[before], braked_mps)
        if math.isfinite(allowed_mps):
            excess_mps = speeds_mps[after] - allowed_mps
            largest = excess_mps if largest is None else max(largest, excess_mps)
    return largest
