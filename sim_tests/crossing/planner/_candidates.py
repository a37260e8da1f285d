"""The twists that a planner compares: what they aim at, and what they command in the next tick."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.arrays import FloatArray

from ._config import PlannerConfig
from ._rollout import clip_to_window

# Tolerance for rounding when a twist is compared with a limit, in m/s.
_ROUNDING_MPS = 1e-9


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


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Motions that turn for a while and then go straight; rows (V) have one final speed.

    Attributes:
        speeds_mps: (V, 1) final speeds, ascending from 0.
        turn_speeds_mps: (V, W) speeds while turning, slower where the corners need it.
        yaw_rates_radps: (V, W) yaw rates of the turn.
        speed_commands_mps: (V, W) what the next tick reaches of the speeds.
        yaw_commands_radps: (V, W) what it reaches of the yaw rates.
        allowed: (V, W) whether the command obeys the limits, or brakes as hard as it can.
    """

    speeds_mps: FloatArray
    turn_speeds_mps: FloatArray
    yaw_rates_radps: FloatArray
    speed_commands_mps: FloatArray
    yaw_commands_radps: FloatArray
    allowed: NDArray[np.bool_]

    def distinct(self) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
        """Return the distinct allowed commands (N,), (N,), and the index (V, W) of each pair.

        Many candidates begin with the same command, since few are in the window of one tick. The
        index of a pair that is not allowed is N.
        """
        index: dict[tuple[float, float], int] = {}
        index_of = [
            index.setdefault((speed, yaw_rate), len(index)) if may else -1
            for speed, yaw_rate, may in zip(
                self.speed_commands_mps.ravel().tolist(),
                self.yaw_commands_radps.ravel().tolist(),
                self.allowed.ravel().tolist(),
                strict=True,
            )
        ]
        pairs = np.array(list(index), dtype=np.float64).reshape(-1, 2)
        where = np.array(index_of, dtype=np.intp).reshape(self.allowed.shape)
        return pairs[:, 0], pairs[:, 1], np.where(where < 0, len(index), where)


class Sampler:
    """The candidates of a robot from tick to tick.

    Args:
        robot: limits of the motion.
        config: number of samples and limits of turning.
    """

    def __init__(self, robot: RobotProfile, config: PlannerConfig) -> None:
        self._robot = robot
        self._config = config
        self._speed_share = np.append(np.linspace(0.0, 1.0, config.speed_samples), 1.0)[:, None]
        spread = np.linspace(-1.0, 1.0, config.yaw_rate_samples)
        # Two more are filled in for each plan: the present rate, and the one that faces the goal.
        self._yaw_share = np.append(np.sign(spread) * np.abs(spread) ** 1.5, [0.0, 0.0])

    def candidates(
        self,
        state: RobotState,
        limits: TwistLimits,
        top_mps: float,
        bearing_rad: float,
        dt_s: float,
    ) -> Candidates:
        """Return motions that end at speeds up to ``top_mps``, with all yaw rates for each.

        Args:
            state: the robot now.
            limits: its limits now.
            top_mps: largest final speed, at most that of the limits.
            bearing_rad: direction to head for, in the base frame.
            dt_s: length of a tick.
        """
        speeds = top_mps * self._speed_share
        speeds[-1] = min(max(state.speed_mps, 0.0), top_mps)
        facing = bearing_rad / self._config.turn_time_s
        turn_speeds, yaw_rates = self._turns(speeds, state, facing, limits)

        fall = self._robot.max_deceleration_mps2 * dt_s
        rise = self._robot.max_acceleration_mps2 * dt_s
        commands = np.maximum(clip_to_window(turn_speeds, state.speed_mps, fall, rise), 0.0)
        # The swing of the corners obeys the limit in the next tick already.
        most_radps = limits.most_yaw_rate_radps(commands)
        turns = np.minimum(np.maximum(yaw_rates, -most_radps), most_radps)
        step = self._config.max_yaw_acceleration_radps2 * dt_s
        turns = clip_to_window(turns, state.yaw_rate_radps, step, step)
        if math.isfinite(limits.curvature_per_m):  # the yaw rate falls with the speed
            tightest = commands * limits.curvature_per_m
            turns = np.minimum(np.maximum(turns, -tightest), tightest)
        swing_mps = (np.abs(turns) - most_radps) * limits.reach_m
        allowed = (swing_mps <= _ROUNDING_MPS) | (commands <= max(state.speed_mps - fall, 0.0))
        return Candidates(speeds, turn_speeds, yaw_rates, commands, turns, allowed)

    def _turns(
        self, speeds: FloatArray, state: RobotState, facing_radps: float, limits: TwistLimits
    ) -> tuple[FloatArray, FloatArray]:
        """Return speeds and yaw rates (V, W) of the turns before the final speeds."""
        if math.isfinite(limits.curvature_per_m):
            # |v| (1 + |curvature| R) is the speed of the fastest point.
            curve = limits.curvature_per_m * self._yaw_share
            extra = np.array([state.yaw_rate_radps, facing_radps]) / max(state.speed_mps, 0.1)
            curve[-2:] = np.clip(extra, -limits.curvature_per_m, limits.curvature_per_m)
            turning = np.abs(curve)
            slower = limits.fastest_point_mps / (1.0 + turning * limits.reach_m)
            slower = np.minimum(slower, limits.yaw_rate_radps / np.maximum(turning, 1e-9))
            turn_speeds = np.minimum(speeds, slower)
            return turn_speeds, curve * turn_speeds
        top_radps = min(limits.yaw_rate_radps, limits.fastest_point_mps / limits.reach_m)
        yaw_rates = top_radps * self._yaw_share
        yaw_rates[-2:] = [
            min(max(rate, -top_radps), top_radps) for rate in (state.yaw_rate_radps, facing_radps)
        ]
        left_mps = np.maximum(limits.fastest_point_mps - np.abs(yaw_rates) * limits.reach_m, 0.0)
        return np.minimum(speeds, left_mps), np.broadcast_to(
            yaw_rates, (len(speeds), len(yaw_rates))
        )
