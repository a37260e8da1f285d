"""The motions of robots on wheels and of holonomic ones, as a planner samples and compares them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nav_adapter import RobotProfile, RobotState
from perception.arrays import FloatArray

from ._geometry import Poses, clip_to_window, follow_arcs, ramp_integral, stopping_integral
from ._sampling import YAW_RATE_RADPS, Sampling, along_time
from ._scene import Aim, Scene

# Number of target speeds from 0 to the highest allowed, and of yaw rates from one limit to the
# other, denser near 0. The present speed and yaw rate, and the rate that faces the goal, are added.
_SPEEDS: Final = 7
_YAW_RATES: Final = 17
# Number of checked poses of a braking robot; the last one is at rest. From 1.5 m/s at 1 m/s² they
# are at most 0.1 s apart. At a closing speed of 3 m/s this cuts a corner by less than the
# clearance.
_BRAKING_SAMPLES: Final = 16
# Tolerance for rounding when a speed is compared with a limit.
_ROUNDING_MPS: Final = 1e-9
# Length of the turn of a robot that steers, as a share of its turning radius.
_TURN_SHARE: Final = 0.8
# A slower robot counts as this fast for its curvature, and has no direction of travel.
_SLOWEST_MPS: Final = 0.02
# Directions of a holonomic robot reach this far to either side of the direction to head for.
_WIDEST_RAD: Final = 2.2
# Share of the yaw rate's limit with which it turns to face its goal.
_CALM_SHARE: Final = 0.4


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

    def most_yaw_rate_radps(self, speed_mps: FloatArray) -> FloatArray:
        """Return the largest yaw rate, either way, at each speed ≥ 0."""
        room_radps = np.maximum(self.fastest_point_mps - speed_mps, 0.0) / self.reach_m
        most_radps = np.minimum(room_radps, self.yaw_rate_radps)
        if math.isfinite(self.curvature_per_m):
            most_radps = np.minimum(most_radps, speed_mps * self.curvature_per_m)
        return np.asarray(most_radps)

    def curve_speed_mps(self, curvature_per_m: FloatArray) -> FloatArray:
        """Return the highest speed on each curve, whose fastest point moves at v (1 + |κ| R)."""
        turning = np.abs(curvature_per_m)
        slower = self.fastest_point_mps / (1.0 + turning * self.reach_m)
        return np.asarray(np.minimum(slower, self.yaw_rate_radps / np.maximum(turning, 1e-9)))


class Tick(NamedTuple):
    """The situation in which a planner chooses a command.

    Attributes:
        state: of the robot.
        limits: of its twists now.
        top_mps: largest final speed of a candidate, at most that of the limits.
        aim: the place to head for.
        dt_s: time for which the command is held.
        scene: people and boxes around the robot.
    """

    state: RobotState
    limits: TwistLimits
    top_mps: float
    aim: Aim
    dt_s: float
    scene: Scene


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Motions to compare; rows (V) have one final speed, columns (W) one turn or direction.

    Attributes:
        commands: (V, W, 2) speed and yaw rate of the next tick, or (V, W, 3) speeds forward and to
            the left, and yaw rate.
        allowed: (V, W) whether the command obeys the limits, or brakes as hard as it can.
        poses: the motion over the horizon; its arrays broadcast to (T, V, W).
        course: cosine and sine of the direction of travel at its end, in the base frame.
        turning: yaw rate over 1.2 rad/s, left positive, of a holonomic robot the direction over
            the widest one.
        turning_now: the same of the present motion.
    """

    commands: FloatArray
    allowed: NDArray[np.bool_]
    poses: Poses
    course: tuple[FloatArray, FloatArray]
    turning: FloatArray
    turning_now: float

    def off_rad(self, to_x_m: FloatArray, to_y_m: FloatArray) -> FloatArray:
        """Return by how much (V, W) each motion ends going past a place, given from (T, V, W)."""
        c, s = self.course
        x, y = to_x_m[-1], to_y_m[-1]
        return np.asarray(np.abs(np.arctan2(y * c - x * s, x * c + y * s)))

    def distinct(self) -> tuple[FloatArray, NDArray[np.intp]]:
        """Return the distinct commands (N, 2 or 3), and the index (V, W) of each in them.

        Many candidates begin with the same command, since few are in the window of one tick.
        """
        commands = self.commands.reshape(-1, self.commands.shape[-1])
        number = np.zeros(len(commands), dtype=np.intp)
        for column in commands.T:  # faster than np.unique of whole rows
            number = len(commands) * number + np.unique(column, return_inverse=True)[1]
        _, first, index = np.unique(number, return_index=True, return_inverse=True)
        return commands[first], index.reshape(self.allowed.shape)


class Drive(ABC):
    """The kinematics of a robot."""

    def __init__(self, robot: RobotProfile, sampling: Sampling) -> None:
        self._robot = robot
        self._sampling = sampling
        self._steers = robot.min_turning_radius_m is not None
        self._t_s = sampling.times_s
        self._turn_t_s = np.minimum(self._t_s, sampling.turn_time_s)
        self._braking_share = along_time(0.0, 1.0, _BRAKING_SAMPLES)
        # The last row is the present speed, so that a robot on a curve can go on as it is.
        self._speed_share = np.append(np.linspace(0.0, 1.0, _SPEEDS), 1.0)[:, None]
        spread = np.linspace(-1.0, 1.0, _YAW_RATES)
        self._spread = np.sign(spread) * np.abs(spread) ** 1.5

    @abstractmethod
    def candidates(self, tick: Tick) -> Candidates:
        """Return motions that end at speeds up to the tick's ``top_mps``."""

    @abstractmethod
    def stopping(self, commands: FloatArray, tick: Tick) -> tuple[Poses, FloatArray]:
        """Return poses and times (T, 1, N) of one tick of each command and a full stop.

        The first time is the end of the tick.
        """

    def brake(self, state: RobotState, dt_s: float) -> tuple[float, ...]:
        """Return full braking along the present curve, as far as the yaw acceleration allows."""
        velocity, yaw_rate = self._velocity(state), state.yaw_rate_radps
        stop_s = math.hypot(*velocity) / self._robot.max_deceleration_mps2
        yaw_stop_s = float(self._yaw_stop_s(np.float64(stop_s), np.float64(yaw_rate)))
        share = 1.0 - dt_s / stop_s if stop_s > dt_s else 0.0
        yaw_share = 1.0 - dt_s / yaw_stop_s if yaw_stop_s > dt_s else 0.0
        return *(part * share for part in velocity), yaw_rate * yaw_share

    @abstractmethod
    def _velocity(self, state: RobotState) -> tuple[float, ...]:
        """Return the speeds of a command that goes on as now."""

    def _yaw_stop_s(self, stop_s: FloatArray, yaw_rate_radps: FloatArray) -> FloatArray:
        """Return the time in which a turn ends: with the speed, or later if it has to."""
        if self._steers:
            return stop_s
        own_s = np.abs(yaw_rate_radps) / self._sampling.yaw_acceleration_radps2
        return np.asarray(np.maximum(stop_s, own_s))


class Wheels(Drive):
    """Robots with a differential drive, and those that steer: they turn and then go straight.

    While it turns the robot is only as fast as its corners allow. A robot that steers follows its
    curve; any other one chooses speed and yaw rate apart.
    """

    def __init__(self, robot: RobotProfile, sampling: Sampling) -> None:
        super().__init__(robot, sampling)
        self._turn_m = _TURN_SHARE * (robot.min_turning_radius_m or 0.0)
        # Two more are filled in for each plan: the present rate, and the one that faces the goal.
        self._yaw_share = np.append(self._spread, [0.0, 0.0])

    def candidates(self, tick: Tick) -> Candidates:
        """Return motions that end at speeds up to the tick's ``top_mps``, with all yaw rates."""
        state, limits = tick.state, tick.limits
        speeds = tick.top_mps * self._speed_share
        speeds[-1] = min(max(state.speed_mps, 0.0), tick.top_mps)
        if self._steers:
            curve = limits.curvature_per_m * self._yaw_share
            now = state.yaw_rate_radps / max(abs(state.speed_mps), 0.1)
            extra = np.array([now, tick.aim.bearing_rad / self._turn_m])
            curve[-2:] = np.clip(extra, -limits.curvature_per_m, limits.curvature_per_m)
            turn_speeds = np.minimum(speeds, limits.curve_speed_mps(curve))
            yaw_rates = curve * turn_speeds
        else:
            top_radps = min(limits.yaw_rate_radps, limits.fastest_point_mps / limits.reach_m)
            yaw_rates = top_radps * self._yaw_share
            facing_radps = tick.aim.bearing_rad / self._sampling.turn_time_s
            yaw_rates[-2:] = [
                min(max(rate, -top_radps), top_radps)
                for rate in (state.yaw_rate_radps, facing_radps)
            ]
            left_mps = limits.fastest_point_mps - np.abs(yaw_rates) * limits.reach_m
            turn_speeds = np.minimum(speeds, np.maximum(left_mps, 0.0))
        commands = np.maximum(self._reached(turn_speeds, tick), 0.0)
        return self._made(tick, speeds, turn_speeds, yaw_rates, commands)

    def backward(self, tick: Tick) -> Candidates:
        """Return motions backward at up to ``top_mps``, on all curves of a robot that steers."""
        curve = tick.limits.curvature_per_m * self._yaw_share
        speeds = np.array([[0.0], [-0.5 * tick.top_mps], [-tick.top_mps]])
        turn_speeds = np.maximum(speeds, -tick.limits.curve_speed_mps(curve))
        commands = self._reached(turn_speeds, tick)
        return self._made(tick, speeds, turn_speeds, curve * turn_speeds, commands)

    def stopping(self, commands: FloatArray, tick: Tick) -> tuple[Poses, FloatArray]:
        """Return what :meth:`Drive.stopping` does."""
        state, dt_s = tick.state, tick.dt_s
        v, w = commands[None, :, 0], commands[None, :, 1]
        stop_s = np.abs(v) / self._robot.max_deceleration_mps2
        yaw_stop_s = self._yaw_stop_s(stop_s, w)
        t_s = dt_s + yaw_stop_s * self._braking_share
        # During the tick the speed lies between the present one and the command: take the larger.
        extra_m = np.maximum(state.speed_mps - v, 0.0) * dt_s
        # The yaw rate ramps from the present one.
        change = state.yaw_rate_radps - w
        acceleration = self._sampling.yaw_acceleration_radps2
        extra_rad = 0.5 * change * np.minimum(np.abs(change) / acceleration, dt_s)
        poses = follow_arcs(
            stopping_integral(v, stop_s, dt_s, t_s) + extra_m,
            stopping_integral(w, yaw_stop_s, dt_s, t_s) + extra_rad,
        )
        return poses, t_s

    def _velocity(self, state: RobotState) -> tuple[float, ...]:
        return (state.speed_mps if self._steers else max(state.speed_mps, 0.0),)

    def _reached(self, speeds: FloatArray, tick: Tick) -> FloatArray:
        """Return what a tick reaches of speeds: only towards 0 does the robot brake."""
        robot, now_mps = self._robot, tick.state.speed_mps
        fall = robot.max_deceleration_mps2 if now_mps > 0.0 else robot.max_acceleration_mps2
        rise = robot.max_deceleration_mps2 if now_mps < 0.0 else robot.max_acceleration_mps2
        return clip_to_window(speeds, now_mps, fall * tick.dt_s, rise * tick.dt_s)

    def _made(
        self,
        tick: Tick,
        speeds: FloatArray,
        turn_speeds: FloatArray,
        yaw_rates: FloatArray,
        commands: FloatArray,
    ) -> Candidates:
        """Return candidates; a roll-out ends when it is as long as the distance to the aim.

        Speeds (V, 1) are final. Turns have speeds (V, W) and yaw rates (V, W) or (W,). Commands
        (V, W) are the speeds that the next tick reaches.
        """
        state, limits = tick.state, tick.limits
        # The swing of the corners obeys the limit in the next tick already.
        most_radps = limits.most_yaw_rate_radps(np.abs(commands))
        turns = np.minimum(np.maximum(yaw_rates, -most_radps), most_radps)
        step = self._sampling.yaw_acceleration_radps2 * tick.dt_s
        turns = clip_to_window(turns, state.yaw_rate_radps, step, step)
        if self._steers:  # the yaw rate falls with the speed
            tightest = np.abs(commands) * limits.curvature_per_m
            turns = np.minimum(np.maximum(turns, -tightest), tightest)
        swing_mps = (np.abs(turns) - most_radps) * limits.reach_m
        slowest = max(abs(state.speed_mps) - self._robot.max_deceleration_mps2 * tick.dt_s, 0.0)
        allowed = (swing_mps <= _ROUNDING_MPS) | (np.abs(commands) <= slowest)
        path, turn = self._roll_out(speeds, turn_speeds, yaw_rates, state)
        poses = follow_arcs(np.minimum(path, tick.aim.distance_m), turn)
        return Candidates(
            np.stack([commands, turns], axis=-1),
            allowed,
            poses,
            (poses.cos_heading[-1], poses.sin_heading[-1]),
            yaw_rates / YAW_RATE_RADPS,
            state.yaw_rate_radps / YAW_RATE_RADPS,
        )

    def _roll_out(
        self, speeds: FloatArray, slow: FloatArray, yaw_rates: FloatArray, state: RobotState
    ) -> tuple[FloatArray, FloatArray]:
        """Return the paths (m) and headings (rad) of the candidates, which broadcast (T, V, W)."""
        robot, speed = self._robot, state.speed_mps
        faster, slower = robot.max_acceleration_mps2, robot.max_deceleration_mps2
        rate = np.where(slow > speed, faster, slower)
        turning_m = ramp_integral(speed, slow, rate, self._turn_t_s)
        end_s = self._sampling.turn_time_s
        after = clip_to_window(slow, speed, slower * end_s, faster * end_s)
        rate = np.where(speeds > after, faster, slower)
        path = turning_m + ramp_integral(after, speeds, rate, self._t_s - self._turn_t_s)
        if self._steers:
            # Its turn has a length, not a time: it cannot turn before it drives.
            divisor = np.copysign(np.maximum(np.abs(slow), _SLOWEST_MPS), slow)
            turned_m = np.minimum(np.maximum(path, -self._turn_m), self._turn_m)
            return path, turned_m * (yaw_rates / divisor)
        acceleration = self._sampling.yaw_acceleration_radps2
        return path, ramp_integral(state.yaw_rate_radps, yaw_rates, acceleration, self._turn_t_s)


class Sideways(Drive):
    """Holonomic robots: they go in one direction, turning slowly to face the goal, or not at all.

    Both accelerations of the profile hold for the whole velocity.
    """

    def candidates(self, tick: Tick) -> Candidates:
        """Return motions at speeds up to ``top_mps`` in directions about the one to head for."""
        state, limits, bearing_rad = tick.state, tick.limits, tick.aim.bearing_rad
        velocity = np.array(self._velocity(state))
        now_rad = 0.0
        if state.travel_mps > _SLOWEST_MPS:
            now_rad = math.remainder(math.atan2(velocity[1], velocity[0]) - bearing_rad, math.tau)
        # Each direction, and the present one, once with a turn to the goal, and once without.
        offsets = np.tile(np.append(_WIDEST_RAD * self._spread, now_rad), 2)
        calm = _CALM_SHARE * min(limits.yaw_rate_radps, limits.fastest_point_mps / limits.reach_m)
        turn_radps = min(max(bearing_rad / self._sampling.turn_time_s, -calm), calm)
        yaw_rates = np.where(np.arange(len(offsets)) < len(offsets) // 2, turn_radps, 0.0)
        speeds = tick.top_mps * self._speed_share
        speeds[-1] = min(state.travel_mps, tick.top_mps)
        room_mps = np.maximum(limits.fastest_point_mps - np.abs(yaw_rates) * limits.reach_m, 0.0)
        speeds = np.minimum(speeds, room_mps)
        bearings = bearing_rad + offsets
        cos, sin = np.cos(bearings), np.sin(bearings)
        targets = np.stack([speeds * cos, speeds * sin], axis=-1)

        commands = self._reached(targets, velocity, tick.dt_s)
        reached = np.hypot(commands[..., 0], commands[..., 1])
        most = limits.most_yaw_rate_radps(reached)
        turns = np.minimum(np.maximum(yaw_rates, -most), most)
        step = self._sampling.yaw_acceleration_radps2 * tick.dt_s
        turns = clip_to_window(turns, state.yaw_rate_radps, step, step)
        fastest = reached + np.abs(turns) * limits.reach_m
        slowest = max(state.travel_mps - self._robot.max_deceleration_mps2 * tick.dt_s, 0.0)
        obeys = fastest <= limits.fastest_point_mps + _ROUNDING_MPS
        obeys &= reached <= limits.speed_mps + _ROUNDING_MPS
        return Candidates(
            np.concatenate([commands, turns[..., None]], axis=-1),
            obeys | (reached <= slowest + _ROUNDING_MPS),
            self._roll_out(targets, velocity, turns, tick.aim.distance_m),
            (cos, sin),
            offsets / _WIDEST_RAD,
            now_rad / _WIDEST_RAD,
        )

    def stopping(self, commands: FloatArray, tick: Tick) -> tuple[Poses, FloatArray]:
        """Return what :meth:`Drive.stopping` does."""
        state, dt_s = tick.state, tick.dt_s
        x, y, w = (commands[None, :, axis] for axis in range(3))
        stop_s = np.hypot(x, y) / self._robot.max_deceleration_mps2
        yaw_stop_s = self._yaw_stop_s(stop_s, w)
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

    def _velocity(self, state: RobotState) -> tuple[float, ...]:
        return state.speed_mps, state.lateral_mps

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
        turn = turns * self._turn_t_s
        return Poses(x / far, y / far, np.cos(turn), np.sin(turn))
