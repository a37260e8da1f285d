"""The motions that a planner compares, and the limits that they obey."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from nav_adapter import NavConstraints, RobotProfile, RobotState
from nav_adapter.motion import clip_twists_ahead
from perception.arrays import FloatArray

from ._config import PlannerConfig
from ._rollout import Poses

#: Tolerance for rounding when a speed is compared with a limit.
ROUNDING_MPS = 1e-9


@dataclass(frozen=True, slots=True)
class TwistLimits:
    """The twists that a robot may have now: |v| ≤ limit, and |v| + |ω| R ≤ that of its corners.

    Attributes:
        speed_mps: limit of the base, at most the robot's own.
        fastest_point_mps: limit of the fastest point; may be infinite.
        yaw_rate_radps: largest yaw rate.
        reach_m: R, the circumscribed radius.
        curvature_per_m: tightest curve of a robot that steers; infinite for any other.
    """

    speed_mps: float
    fastest_point_mps: float
    yaw_rate_radps: float
    reach_m: float
    curvature_per_m: float

    @classmethod
    def of(
        cls, robot: RobotProfile, config: PlannerConfig, constraints: NavConstraints
    ) -> TwistLimits:
        """Return the limits of ``robot`` under ``constraints``."""
        assert constraints.fastest_point_limit_mps is not None
        radius_m = robot.min_turning_radius_m
        return cls(
            min(constraints.speed_limit_mps, robot.max_speed_mps),
            constraints.fastest_point_limit_mps,
            config.max_yaw_rate_radps,
            robot.circumscribed_radius_m,
            math.inf if radius_m is None else 1.0 / radius_m,
        )

    def most_yaw_rate_radps(self, speed_mps: FloatArray) -> FloatArray:
        """Return the largest yaw rate, either way, at each speed ≥ 0."""
        room_radps = np.maximum(self.fastest_point_mps - speed_mps, 0.0) / self.reach_m
        most_radps = np.minimum(room_radps, self.yaw_rate_radps)
        if math.isfinite(self.curvature_per_m):
            most_radps = np.minimum(most_radps, speed_mps * self.curvature_per_m)
        return np.asarray(most_radps)


@dataclass(frozen=True, slots=True)
class Aim:
    """The place that a plan heads for.

    Attributes:
        distance_m: distance to the goal.
        bearing_rad: direction to head for, in the base frame.
    """

    distance_m: float
    bearing_rad: float

    @classmethod
    def at(cls, place_odom_m: FloatArray, state: RobotState) -> Aim:
        """Return the aim at a place; one straight behind always has the bearing −π."""
        x, y = (place_odom_m - state.position_odom_m).tolist()
        c, s = math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)
        forward_m, left_m = c * x + s * y, c * y - s * x
        bearing_rad = math.atan2(left_m, forward_m)
        if bearing_rad > math.pi - 1e-6:  # else rounding would choose the side to turn to
            bearing_rad -= math.tau
        return cls(math.hypot(forward_m, left_m), bearing_rad)


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Motions to compare; rows (V) have one final speed, columns (W) one turn or direction.

    Attributes:
        commands: (V, W, 2) speed and yaw rate of the next tick, or (V, W, 3) speeds forward and to
            the left, and yaw rate.
        allowed: (V, W) whether the command obeys the limits, or brakes as hard as it can.
        poses: (T, V, W) the motion over the horizon.
        course: cosine and sine (V, W) of the direction of travel at its end, in the base frame.
        turning: (V, W) share of the largest turn, left positive.
        turning_now: the same of the present motion.
    """

    commands: FloatArray
    allowed: NDArray[np.bool_]
    poses: Poses
    course: tuple[FloatArray, FloatArray]
    turning: FloatArray
    turning_now: float

    def distinct(self) -> tuple[FloatArray, NDArray[np.intp]]:
        """Return the distinct allowed commands (N, 2 or 3), and the index (V, W) of each in them.

        Many candidates begin with the same command, since few are in the window of one tick. The
        index of a command that is not allowed is N.
        """
        size = self.commands.shape[-1]
        index: dict[tuple[float, ...], int] = {}
        index_of = [
            index.setdefault(tuple(command), len(index)) if may else -1
            for command, may in zip(
                self.commands.reshape(-1, size).tolist(),
                self.allowed.ravel().tolist(),
                strict=True,
            )
        ]
        commands = np.array(list(index), dtype=np.float64).reshape(-1, size)
        where = np.array(index_of, dtype=np.intp).reshape(self.allowed.shape)
        return commands, np.where(where < 0, len(index), where)


class Motion(Protocol):
    """The kinematics of a robot, as a planner samples them."""

    def candidates(
        self, state: RobotState, limits: TwistLimits, top_mps: float, aim: Aim, dt_s: float
    ) -> Candidates:
        """Return motions that end at speeds up to ``top_mps``.

        Args:
            state: the robot now.
            limits: its limits now.
            top_mps: largest final speed, at most that of the limits.
            aim: the place to head for.
            dt_s: length of a tick.
        """
        ...

    def stopping(
        self, commands: FloatArray, state: RobotState, dt_s: float
    ) -> tuple[Poses, FloatArray]:
        """Return poses (T, 1, N) and times (T, 1, N) of one tick of each command and a full stop.

        The first time is the end of the tick.
        """
        ...

    def brake(self, state: RobotState, dt_s: float) -> tuple[float, ...]:
        """Return the command that brakes as hard as it may along the present curve."""
        ...


def along_time(first: float, last: float, samples: int) -> FloatArray:
    """Return (T, 1, 1) numbers from ``first`` to ``last``."""
    return np.linspace(first, last, samples, dtype=np.float64)[:, None, None]


def within_next_limits(
    command: tuple[float, ...], state: RobotState, constraints: NavConstraints, dt_s: float
) -> tuple[float, ...]:
    """Return a command slowed down until it obeys the limits of the next two ticks.

    It is never slower than full braking. Constraints that ``NavAdapter`` did not make, and those
    without people, foresee no limit.
    """
    robot = constraints.robot
    if constraints.speed_basis is None or robot is None or not constraints.obstacles:
        return command
    speed = math.hypot(*command[:-1])
    slowest = abs(state.travel_mps) - robot.max_deceleration_mps2 * dt_s
    if speed <= max(slowest, 0.0):
        return command
    *velocity, yaw_rate = clip_twists_ahead(
        constraints, state, np.array(command), dt_s, slack_mps=0.0
    ).tolist()
    clipped = math.hypot(*velocity)
    share = max(clipped, slowest, 0.0) / speed
    return *(share * part for part in command[:-1]), yaw_rate
