"""Candidates of robots on wheels: differential drives, and robots that steer."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from nav_adapter import RobotProfile, RobotState
from perception.arrays import FloatArray

from ._candidates import ROUNDING_MPS, Aim, Candidates, TwistLimits, along_time
from ._config import PlannerConfig
from ._rollout import Poses, clip_to_window, follow_arcs, ramp_integral, stopping_integral

# Number of checked poses of a braking robot; the last one is at rest. From 1.5 m/s at 1 m/s² they
# are at most 0.1 s apart. At a closing speed of 3 m/s this cuts a corner by less than the
# clearance.
BRAKING_SAMPLES: Final = 16
# Length of the turn of a robot that steers, as a share of its turning radius.
_TURN_SHARE: Final = 0.8
# Divisor for the curvature of a robot that stands.
_SLOWEST_MPS: Final = 0.02


class SteeredMotion:
    """Candidates that turn for a while and then go straight.

    While it turns the robot is only as fast as its corners allow. A robot that steers follows its
    curve; any other one chooses speed and yaw rate apart.

    Args:
        robot: limits of the motion.
        config: horizon, number of samples, limits of turning.
    """

    def __init__(self, robot: RobotProfile, config: PlannerConfig) -> None:
        self._robot = robot
        self._config = config
        self._steers = robot.min_turning_radius_m is not None
        self._turn_m = _TURN_SHARE * (robot.min_turning_radius_m or 0.0)
        samples = max(2, math.ceil(config.horizon_s / config.step_s))
        self._t_s = along_time(config.horizon_s / samples, config.horizon_s, samples)
        self._turn_t_s = np.minimum(self._t_s, config.turn_time_s)
        self._braking_share = along_time(0.0, 1.0, BRAKING_SAMPLES)
        # The last row is the present speed, so that a robot on a curve can go on as it is.
        shares = np.append(np.linspace(0.0, 1.0, config.speed_samples), 1.0)
        self._speed_share = shares[:, None]
        spread = np.linspace(-1.0, 1.0, config.yaw_rate_samples)
        # Two more are filled in for each plan: the present rate, and the one that faces the goal.
        self._yaw_share = np.append(np.sign(spread) * np.abs(spread) ** 1.5, [0.0, 0.0])

    def candidates(
        self, state: RobotState, limits: TwistLimits, top_mps: float, aim: Aim, dt_s: float
    ) -> Candidates:
        """Return motions that end at speeds up to ``top_mps``, with all yaw rates for each."""
        speeds = top_mps * self._speed_share
        speeds[-1] = min(max(state.speed_mps, 0.0), top_mps)
        turn_speeds, yaw_rates = self._turns(speeds, state, aim.bearing_rad, limits)
        commands = np.maximum(self._reached(turn_speeds, state.speed_mps, dt_s), 0.0)
        return self._made(state, limits, aim, dt_s, (speeds, turn_speeds, yaw_rates), commands)

    def backward(
        self, state: RobotState, limits: TwistLimits, top_mps: float, aim: Aim, dt_s: float
    ) -> Candidates:
        """Return motions backward at up to ``top_mps``, on all curves of a robot that steers."""
        curve = limits.curvature_per_m * self._yaw_share
        turning = np.abs(curve)
        most = limits.fastest_point_mps / (1.0 + turning * limits.reach_m)
        most = np.minimum(most, limits.yaw_rate_radps / np.maximum(turning, 1e-9))
        speeds = np.array([[0.0], [-0.5 * top_mps], [-top_mps]])
        turn_speeds = np.maximum(speeds, -most)
        commands = self._reached(turn_speeds, state.speed_mps, dt_s)
        motions = (speeds, turn_speeds, curve * turn_speeds)
        return self._made(state, limits, aim, dt_s, motions, commands)

    def stopping(
        self, commands: FloatArray, state: RobotState, dt_s: float
    ) -> tuple[Poses, FloatArray]:
        """Return poses and times (T, 1, N) of one tick of each command and a full stop."""
        v, w = commands[None, :, 0], commands[None, :, 1]
        acceleration = self._config.max_yaw_acceleration_radps2
        stop_s = np.abs(v) / self._robot.max_deceleration_mps2
        yaw_stop_s = stop_s if self._steers else self._yaw_stop_s(stop_s, w)
        t_s = dt_s + yaw_stop_s * self._braking_share
        # During the tick the speed lies between the present one and the command: take the larger.
        extra_m = np.maximum(state.speed_mps - v, 0.0) * dt_s
        # The yaw rate ramps from the present one.
        change = state.yaw_rate_radps - w
        extra_rad = 0.5 * change * np.minimum(np.abs(change) / acceleration, dt_s)
        poses = follow_arcs(
            stopping_integral(v, stop_s, dt_s, t_s) + extra_m,
            stopping_integral(w, yaw_stop_s, dt_s, t_s) + extra_rad,
        )
        return poses, t_s

    def brake(self, state: RobotState, dt_s: float) -> tuple[float, ...]:
        """Return full braking along the present curve, as far as the yaw acceleration allows."""
        speed, yaw_rate = state.speed_mps, state.yaw_rate_radps
        if not self._steers:
            speed = max(speed, 0.0)
        stop_s = abs(speed) / self._robot.max_deceleration_mps2
        yaw_stop_s = stop_s if self._steers else float(self._yaw_stop_s(stop_s, yaw_rate))
        return (
            speed * (1.0 - dt_s / stop_s) if stop_s > dt_s else 0.0,
            yaw_rate * (1.0 - dt_s / yaw_stop_s) if yaw_stop_s > dt_s else 0.0,
        )

    def _yaw_stop_s(self, stop_s: ArrayLike, yaw_rate: ArrayLike) -> FloatArray:
        """Return the time in which a turn ends: with the speed, or later if it has to."""
        own_s = np.abs(yaw_rate) / self._config.max_yaw_acceleration_radps2
        return np.asarray(np.maximum(stop_s, own_s))

    def _reached(self, speeds: FloatArray, speed_mps: float, dt_s: float) -> FloatArray:
        """Return what a tick reaches of speeds; a robot that goes backward brakes upwards."""
        fall = self._robot.max_deceleration_mps2 * dt_s
        rise = self._robot.max_acceleration_mps2 * dt_s
        if speed_mps < 0.0:
            fall, rise = rise, fall
        return clip_to_window(speeds, speed_mps, fall, rise)

    def _turns(
        self, speeds: FloatArray, state: RobotState, bearing_rad: float, limits: TwistLimits
    ) -> tuple[FloatArray, FloatArray]:
        """Return speeds and yaw rates (V, W) of the turns before the final speeds."""
        if self._steers:
            # |v| (1 + |curvature| R) is the speed of the fastest point.
            curve = limits.curvature_per_m * self._yaw_share
            now = state.yaw_rate_radps / max(abs(state.speed_mps), 0.1)
            extra = np.array([now, bearing_rad / self._turn_m])
            curve[-2:] = np.clip(extra, -limits.curvature_per_m, limits.curvature_per_m)
            turning = np.abs(curve)
            slower = limits.fastest_point_mps / (1.0 + turning * limits.reach_m)
            slower = np.minimum(slower, limits.yaw_rate_radps / np.maximum(turning, 1e-9))
            turn_speeds = np.minimum(speeds, slower)
            return turn_speeds, curve * turn_speeds
        top_radps = min(limits.yaw_rate_radps, limits.fastest_point_mps / limits.reach_m)
        yaw_rates = top_radps * self._yaw_share
        facing_radps = bearing_rad / self._config.turn_time_s
        yaw_rates[-2:] = [
            min(max(rate, -top_radps), top_radps) for rate in (state.yaw_rate_radps, facing_radps)
        ]
        left_mps = np.maximum(limits.fastest_point_mps - np.abs(yaw_rates) * limits.reach_m, 0.0)
        shape = (len(speeds), len(yaw_rates))
        return np.minimum(speeds, left_mps), np.broadcast_to(yaw_rates, shape)

    def _made(
        self,
        state: RobotState,
        limits: TwistLimits,
        aim: Aim,
        dt_s: float,
        motions: tuple[FloatArray, FloatArray, FloatArray],
        commands: FloatArray,
    ) -> Candidates:
        """Return candidates.

        Args:
            state: the robot now.
            limits: its limits now.
            aim: the place to head for; a roll-out ends when it is as long as the distance to it.
            dt_s: length of a tick.
            motions: final speeds (V, 1), speeds of the turns (V, W), and yaw rates (V, W).
            commands: (V, W) speeds that the next tick reaches.
        """
        speeds, turn_speeds, yaw_rates = motions
        # The swing of the corners obeys the limit in the next tick already.
        most_radps = limits.most_yaw_rate_radps(np.abs(commands))
        turns = np.minimum(np.maximum(yaw_rates, -most_radps), most_radps)
        step = self._config.max_yaw_acceleration_radps2 * dt_s
        turns = clip_to_window(turns, state.yaw_rate_radps, step, step)
        if self._steers:  # the yaw rate falls with the speed
            tightest = np.abs(commands) * limits.curvature_per_m
            turns = np.minimum(np.maximum(turns, -tightest), tightest)
        swing_mps = (np.abs(turns) - most_radps) * limits.reach_m
        slowest = max(abs(state.speed_mps) - self._robot.max_deceleration_mps2 * dt_s, 0.0)
        allowed = (swing_mps <= ROUNDING_MPS) | (np.abs(commands) <= slowest)
        path, turn = self._roll_out(speeds, turn_speeds, yaw_rates, state)
        poses = follow_arcs(np.minimum(path, aim.distance_m), turn)
        return Candidates(
            np.stack([commands, turns], axis=-1),
            allowed,
            poses,
            (poses.cos_heading[-1], poses.sin_heading[-1]),
            yaw_rates / self._config.max_yaw_rate_radps,
            state.yaw_rate_radps / self._config.max_yaw_rate_radps,
        )

    def _roll_out(
        self, speeds: FloatArray, slow: FloatArray, yaw_rates: FloatArray, state: RobotState
    ) -> tuple[FloatArray, FloatArray]:
        """Return the paths (m) and headings (rad) of the candidates, both (T, V, W)."""
        robot, speed = self._robot, state.speed_mps
        faster, slower = robot.max_acceleration_mps2, robot.max_deceleration_mps2
        rate = np.where(slow > speed, faster, slower)
        turning_m = ramp_integral(speed, slow, rate, self._turn_t_s)
        end_s = self._config.turn_time_s
        after = clip_to_window(slow, speed, slower * end_s, faster * end_s)
        rate = np.where(speeds > after, faster, slower)
        path = turning_m + ramp_integral(after, speeds, rate, self._t_s - self._turn_t_s)
        if self._steers:
            # Its turn has a length, not a time: it cannot turn before it drives.
            divisor = np.copysign(np.maximum(np.abs(slow), _SLOWEST_MPS), slow)
            turned_m = np.minimum(np.maximum(path, -self._turn_m), self._turn_m)
            return path, turned_m * (yaw_rates / divisor)
        acceleration = self._config.max_yaw_acceleration_radps2
        return path, ramp_integral(state.yaw_rate_radps, yaw_rates, acceleration, self._turn_t_s)
