"""Candidates of robots that can move sideways."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from nav_adapter import RobotProfile, RobotState
from perception.arrays import FloatArray

from ._candidates import ROUNDING_MPS, Aim, Candidates, TwistLimits, along_time
from ._config import PlannerConfig
from ._rollout import Poses, stopping_integral
from ._steered import BRAKING_SAMPLES

# Directions reach this far to either side of the direction to head for.
_WIDEST_RAD: Final = 2.2
# Share of the yaw rate's limit with which the robot turns to face its goal.
_CALM_SHARE: Final = 0.4
# A slower robot has no direction of travel.
_STANDING_MPS: Final = 0.02


class SidewaysMotion:
    """Candidates that travel in one direction, turning slowly to face the goal, or not at all.

    Args:
        robot: limits of the motion; both accelerations hold for the whole velocity.
        config: horizon, number of samples, limits of turning.
    """

    def __init__(self, robot: RobotProfile, config: PlannerConfig) -> None:
        self._robot = robot
        self._config = config
        samples = max(2, math.ceil(config.horizon_s / config.step_s))
        self._t_s = along_time(config.horizon_s / samples, config.horizon_s, samples)
        self._braking_share = along_time(0.0, 1.0, BRAKING_SAMPLES)
        shares = np.append(np.linspace(0.0, 1.0, config.speed_samples), 1.0)
        self._speed_share = shares[:, None]
        spread = np.linspace(-1.0, 1.0, config.yaw_rate_samples)
        # The present direction is filled in for each plan.
        self._offsets_rad = np.append(_WIDEST_RAD * np.sign(spread) * np.abs(spread) ** 1.5, 0.0)

    def candidates(
        self, state: RobotState, limits: TwistLimits, top_mps: float, aim: Aim, dt_s: float
    ) -> Candidates:
        """Return motions at speeds up to ``top_mps`` in directions about the one to head for."""
        velocity = np.array([state.speed_mps, state.lateral_mps])
        offsets = self._offsets_rad.copy()
        now_rad = 0.0
        if state.travel_mps > _STANDING_MPS:
            now_rad = math.remainder(
                math.atan2(velocity[1], velocity[0]) - aim.bearing_rad, math.tau
            )
            offsets[-1] = now_rad
        # Each direction once with a turn to the goal, and once without.
        offsets = np.tile(offsets, 2)
        turn_radps = self._facing_radps(limits, aim.bearing_rad)
        yaw_rates = np.where(np.arange(len(offsets)) < len(offsets) // 2, turn_radps, 0.0)
        speeds = top_mps * self._speed_share
        speeds[-1] = min(state.travel_mps, top_mps)
        room_mps = np.maximum(limits.fastest_point_mps - np.abs(yaw_rates) * limits.reach_m, 0.0)
        speeds = np.minimum(speeds, room_mps)
        bearings = aim.bearing_rad + offsets
        cos, sin = np.cos(bearings), np.sin(bearings)
        targets = np.stack([speeds * cos, speeds * sin], axis=-1)

        commands = self._reached(targets, velocity, dt_s)
        step = self._config.max_yaw_acceleration_radps2 * dt_s
        turn = state.yaw_rate_radps
        reached = np.hypot(commands[..., 0], commands[..., 1])
        most = np.minimum(
            np.maximum(limits.fastest_point_mps - reached, 0.0) / limits.reach_m,
            limits.yaw_rate_radps,
        )
        turns = np.minimum(np.maximum(yaw_rates, -most), most)
        turns = np.minimum(np.maximum(turns, turn - step), turn + step)
        fastest = reached + np.abs(turns) * limits.reach_m
        slowest = max(state.travel_mps - self._robot.max_deceleration_mps2 * dt_s, 0.0)
        obeys = fastest <= limits.fastest_point_mps + ROUNDING_MPS
        obeys &= reached <= limits.speed_mps + ROUNDING_MPS
        poses = self._roll_out(targets, velocity, turns, aim.distance_m)
        return Candidates(
            np.concatenate([commands, turns[..., None]], axis=-1),
            obeys | (reached <= slowest + ROUNDING_MPS),
            poses,
            (np.broadcast_to(cos, reached.shape), np.broadcast_to(sin, reached.shape)),
            np.broadcast_to(offsets / _WIDEST_RAD, reached.shape),
            now_rad / _WIDEST_RAD,
        )

    def stopping(
        self, commands: FloatArray, state: RobotState, dt_s: float
    ) -> tuple[Poses, FloatArray]:
        """Return poses and times (T, 1, N) of one tick of each command and a full stop."""
        x, y, w = (commands[None, :, axis] for axis in range(3))
        speed = np.hypot(x, y)
        stop_s = speed / self._robot.max_deceleration_mps2
        yaw_stop_s = np.maximum(stop_s, np.abs(w) / self._config.max_yaw_acceleration_radps2)
        t_s = dt_s + yaw_stop_s * self._braking_share
        # During the tick the velocity ramps from the present one.
        extra_x, extra_y = (
            np.maximum((now - then) * np.sign(now), 0.0) * np.sign(now) * dt_s
            for now, then in ((state.speed_mps, x), (state.lateral_mps, y))
        )
        turn = stopping_integral(w, yaw_stop_s, dt_s, t_s)
        poses = Poses(
            stopping_integral(x, stop_s, dt_s, t_s) + extra_x,
            stopping_integral(y, stop_s, dt_s, t_s) + extra_y,
            np.cos(turn),
            np.sin(turn),
        )
        return poses, t_s

    def brake(self, state: RobotState, dt_s: float) -> tuple[float, ...]:
        """Return full braking along the present direction."""
        speed, yaw_rate = state.travel_mps, state.yaw_rate_radps
        stop_s = speed / self._robot.max_deceleration_mps2
        yaw_stop_s = max(stop_s, abs(yaw_rate) / self._config.max_yaw_acceleration_radps2)
        share = 1.0 - dt_s / stop_s if stop_s > dt_s else 0.0
        return (
            state.speed_mps * share,
            state.lateral_mps * share,
            yaw_rate * (1.0 - dt_s / yaw_stop_s) if yaw_stop_s > dt_s else 0.0,
        )

    def _facing_radps(self, limits: TwistLimits, bearing_rad: float) -> float:
        """Return the yaw rate that turns the robot to the direction to head for."""
        most = min(limits.yaw_rate_radps, limits.fastest_point_mps / limits.reach_m)
        most *= _CALM_SHARE
        return min(max(bearing_rad / self._config.turn_time_s, -most), most)

    def _reached(self, targets: FloatArray, velocity: FloatArray, dt_s: float) -> FloatArray:
        """Return (V, W, 2) what a tick reaches of velocities, nearest on the straight way there."""
        robot = self._robot
        change = targets - velocity
        size = np.hypot(change[..., 0], change[..., 1])
        slows = np.hypot(targets[..., 0], targets[..., 1]) < math.hypot(*velocity.tolist())
        rate = np.where(slows, robot.max_deceleration_mps2, robot.max_acceleration_mps2)
        share = np.minimum(rate * dt_s / np.maximum(size, 1e-12), 1.0)
        return np.asarray(velocity + share[..., None] * change)

    def _roll_out(
        self, targets: FloatArray, velocity: FloatArray, turns: FloatArray, distance_m: float
    ) -> Poses:
        """Return the poses (T, V, W) of velocities that ramp to their targets."""
        robot, t_s = self._robot, self._t_s
        change = targets - velocity
        size = np.hypot(change[..., 0], change[..., 1])
        rate = min(robot.max_acceleration_mps2, robot.max_deceleration_mps2)
        ramp_s = np.maximum(size / rate, 1e-9)
        within = np.minimum(t_s, ramp_s)
        behind = within - 0.5 * within**2 / ramp_s  # lag of the ramp, in seconds
        x, y = (targets[..., axis] * t_s - change[..., axis] * behind for axis in (0, 1))
        # A roll-out ends when it is as far as the goal.
        far = np.maximum(np.hypot(x, y) / max(distance_m, 1e-6), 1.0)
        turn = turns * np.minimum(t_s, self._config.turn_time_s)
        return Poses(x / far, y / far, np.cos(turn), np.sin(turn))
