"""Settings of the dynamic window."""

from __future__ import annotations

import math
from typing import Final

from pydantic import Field, model_validator

from nav_adapter import RobotProfile

from ...world.config import SimConfig

_LONGEST_HORIZON_S: Final = 7.5


class PlannerConfig(SimConfig):
    """Settings of :class:`SamplingPlanner`: sampling, horizon, clearances and cost weights.

    The weights multiply dimensionless costs. One unit is the gain of driving straight to a far goal
    at the robot's maximum speed over standing still.
    """

    horizon_s: float = Field(default=3.0, ge=1.0, le=10.0)
    """Horizon of roll-outs and predictions of people, in seconds."""
    step_s: float = Field(default=0.2, ge=0.05, le=0.5)
    """Time between the poses of a roll-out, in seconds."""
    turn_time_s: float = Field(default=0.8, gt=0.0, le=10.0)
    """Time for which a candidate turns before it goes straight, in seconds."""
    speed_samples: int = Field(default=7, ge=2, le=50)
    """Number of target speeds from 0 to the highest allowed; both ends included."""
    yaw_rate_samples: int = Field(default=17, ge=3, le=101)
    """Number of yaw rates from one limit to the other, denser near 0; the rate that faces the goal
    after ``turn_time_s`` and the present rate are added."""

    max_yaw_rate_radps: float = Field(default=1.2, gt=0.0, le=3.5)
    """Largest commanded yaw rate, in rad/s."""
    max_yaw_acceleration_radps2: float = Field(default=3.0, gt=0.0)
    """Largest change of the commanded yaw rate, in rad/s²."""

    goal_tolerance_m: float = Field(default=0.1, gt=0.0, le=1.0)
    """Distance at which the goal counts as reached and the robot stops, in metres."""
    goal_deceleration_fraction: float = Field(default=0.6, gt=0.0, le=1.0)
    """Share of the robot's deceleration used to arrive at the goal; the rest is in reserve."""

    clearance_m: float = Field(default=0.05, ge=0.0, le=1.0)
    """Gap between footprint and obstacle that a braking robot must keep, in metres."""
    standing_speed_mps: float = Field(default=0.3, ge=0.0)
    """Speed below which people count as standing, in m/s; the robot heads past them."""
    detour_margin_m: float = Field(default=0.10, ge=0.0)
    """Margin of that heading beyond the footprint's half width and ``clearance_m``, in metres."""
    person_comfort_m: float = Field(default=0.40, gt=0.0, le=3.0)
    """Gap to a person's radius below which closeness costs, in metres."""
    static_comfort_m: float = Field(default=0.25, gt=0.0, le=3.0)
    """Gap to a static box below which closeness costs, in metres."""
    front_time_s: float = Field(default=1.2, ge=0.0, le=5.0)
    """Length of the strip ahead of a walking person, in seconds; being in it costs, so that the
    robot passes behind a crossing person."""
    give_way_s: float = Field(default=6.0, ge=0.0, le=20.0)
    """Time within which people have to enter the robot's way for it to let them pass first, in
    seconds; 0 turns this off. The robot slows down early instead of stopping near them."""
    crossing_speed_mps: float = Field(default=0.5, gt=0.0)
    """Speed across the robot's way below which people may be waiting for it, in m/s."""
    late_weight: float = Field(default=0.3, ge=0.0, le=1.0)
    """Weight of closeness to people at the end of the horizon relative to closeness now."""
    late_static_weight: float = Field(default=0.0, ge=0.0, le=1.0)
    """The same for boxes; small, since the robot will turn again before it is there."""

    heading_weight: float = Field(default=0.3, ge=0.0)
    """Cost of facing away from the goal (by π) at the end of the roll-out."""
    person_weight: float = Field(default=1.5, ge=0.0)
    """Cost of touching a person's radius now."""
    room_m: float = Field(default=2.0, gt=0.0, le=5.0)
    """Gap to the body of a standing person below which closeness costs, in metres; compares only
    candidates of the same speed. Near people every speed limit is low, whatever their radius, so
    the robot passes at a distance where it can."""
    room_weight: float = Field(default=2.0, ge=0.0)
    """Weight of the closeness within ``room_m``."""
    front_weight: float = Field(default=0.6, ge=0.0)
    """Cost of being in the strip that a person walks through now."""
    static_weight: float = Field(default=0.5, ge=0.0)
    """Cost of touching a static box now."""
    turn_weight: float = Field(default=0.02, ge=0.0)
    """Cost of turning at the largest yaw rate."""
    smoothness_weight: float = Field(default=0.05, ge=0.0)
    """Cost of changing the yaw rate by its largest value."""
    keep_right_weight: float = Field(default=0.01, ge=0.0)
    """Cost of turning left at the largest yaw rate while people are about; settles ties."""

    @classmethod
    def for_robot(cls, robot: RobotProfile) -> PlannerConfig:
        """Return the defaults, fitted to the limits of ``robot``.

        Turning keeps to the profile's yaw rate and yaw acceleration, and costs as much per rad/s as
        by default. The horizon is at least twice the time to stop from full speed. Distances to
        people and boxes stay, since they do not depend on the robot.
        """
        usual = cls()
        yaw_rate = min(usual.max_yaw_rate_radps, robot.max_yaw_rate_radps or math.inf)
        yaw_acceleration = min(
            usual.max_yaw_acceleration_radps2, robot.max_yaw_acceleration_radps2 or math.inf
        )
        share = yaw_rate / usual.max_yaw_rate_radps
        stop_s = robot.max_speed_mps / robot.max_deceleration_mps2
        longer = min(max(2.0 * stop_s / usual.horizon_s, 1.0), _LONGEST_HORIZON_S / usual.horizon_s)
        return cls(
            horizon_s=usual.horizon_s * longer,
            step_s=min(usual.step_s * longer, 0.5),
            turn_time_s=usual.turn_time_s * longer,
            max_yaw_rate_radps=yaw_rate,
            max_yaw_acceleration_radps2=yaw_acceleration,
            turn_weight=usual.turn_weight * share**2,
            smoothness_weight=usual.smoothness_weight * share,
            keep_right_weight=usual.keep_right_weight * share,
        )

    @model_validator(mode="after")
    def _turns_to_its_goal(self) -> PlannerConfig:
        """Refuse weights with which standing costs less than turning to the goal."""
        gain = self.heading_weight * self.turn_time_s / math.pi
        price = (self.smoothness_weight + self.keep_right_weight) / self.max_yaw_rate_radps
        if gain <= price:
            raise ValueError(
                "heading_weight · turn_time_s / π must exceed (smoothness_weight + "
                f"keep_right_weight) / max_yaw_rate_radps, got {gain:.3g} against {price:.3g}: "
                "a robot facing away from its goal would stand still"
            )
        return self
