"""The reference local planner: a dynamic-window planner among moving people and fixed boxes."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.arrays import FloatArray, finite_array, finite_number

from ...world.errors import SimError
from ._candidates import Candidates, Sampler, TwistLimits
from ._config import PlannerConfig
from ._detour import detour_bearing_rad
from ._rollout import Poses, clip_to_window, follow_arcs, ramp_integral, stopping_integral
from ._scene import FootprintBox, Scene

# Number of checked poses of a braking robot; the last one is at rest. From 1.5 m/s at 1 m/s² they
# are at most 0.1 s apart. At a closing speed of 3 m/s this cuts a corner by less than the
# clearance.
_BRAKING_SAMPLES: Final = 16
# Tolerance for rounding when a motion is compared with waiting.
_SLACK_M: Final = 1e-5
# Costs closer than this are equal; the order of the samples then decides, not the rounding.
_TIE: Final = 1e-9
# Added to the distances from which on people and boxes do not count, against rounding.
_FAR_M: Final = 0.01
# A slower robot counts as standing.
_STANDING_MPS: Final = 0.02
_STANDING: Final = Poses(*(np.asarray(value) for value in (0.0, 0.0, 1.0, 0.0)))


class SamplingPlanner:
    """A dynamic-window planner for a differential-drive robot (Fox, Burgard and Thrun 1997).

    It drives to a goal among moving people and fixed boxes. A candidate is a target speed and a yaw
    rate that is held for a while. Each is rolled out in closed form and judged twice:

    * It must be *safe*: one tick of it followed by full braking keeps ``clearance_m`` to every box
      and, until the robot stands, to every person's disc moving on at constant velocity. Where that
      gap is already gone, because a radius grew or a person walked up, motion that leaves at least
      the gap that waiting would leave is safe too, so that the robot can get out. A moving robot
      keeps enough distance ahead to turn on the spot; near people a standing robot always may.
    * It should be *good*: near the goal soon, facing it, away from people, boxes and the strip that
      a walking person is about to use, at a distance from people's bodies, without needless
      turning. If someone stands in front of the goal, the robot heads for the tangent past them.

    If nothing is safe the robot brakes as hard as it may along its present curve. It never
    reverses. The command depends only on the arguments: there is no memory between calls. People
    and goal are judged in the robot's frame, so turning or shifting the world changes nothing.

    Args:
        robot: footprint and limits. The footprint counts with its bounding rectangle.
        static_boxes_odom_m: (N, 4) fixed obstacles x_min, y_min, x_max, y_max; None for none.
        config: sampling and preferences; None for :meth:`PlannerConfig.for_robot`.

    Raises:
        SimError: if the boxes are not finite or a minimum is not below its maximum.
    """

    def __init__(
        self,
        robot: RobotProfile,
        static_boxes_odom_m: ArrayLike | None = None,
        config: PlannerConfig | None = None,
    ) -> None:
        self.robot = robot
        self.config = config = config if config is not None else PlannerConfig.for_robot(robot)
        self._footprint = FootprintBox.of(robot)
        self._boxes_odom_m = _checked_boxes(static_boxes_odom_m)

        def along_time(first: float, last: float, samples: int) -> FloatArray:
            return np.linspace(first, last, samples, dtype=np.float64)[:, None, None]

        samples = max(2, math.ceil(config.horizon_s / config.step_s))
        self._t_s = along_time(config.horizon_s / samples, config.horizon_s, samples)
        # From the first sample past the turn on, the heading stays.
        turning = 1 + int(np.searchsorted(self._t_s.ravel(), config.turn_time_s))
        self._turn_t_s = np.minimum(self._t_s, config.turn_time_s)
        self._turning = slice(0, turning)
        self._late_people = along_time(1.0, config.late_weight, samples)
        self._late_static = along_time(1.0, config.late_static_weight, samples)
        self._braking_share = along_time(0.0, 1.0, _BRAKING_SAMPLES)
        self._sampler = Sampler(robot, config)
        # A robot that steers follows its curve; any other one chooses yaw rate and speed apart.
        self._steers = robot.min_turning_radius_m is not None

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: ArrayLike,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Choose the command for the next tick.

        Args:
            robot_state: state of the robot.
            goal_odom_m: (2,) goal of its base origin.
            constraints: people as discs and the speed limit, at the time of the state.
            dt_s: time for which the command is held, > 0.

        Returns:
            ``(speed_mps, yaw_rate_radps)``. The robot can reach the speed in ``dt_s``. It is never
            negative, and above ``constraints.speed_limit_mps`` only where full braking does not get
            below the limit in one tick. With the yaw rate, |v| + |ω| R obeys
            ``constraints.fastest_point_limit_mps`` (R is the circumscribed radius), with the same
            exception. A robot that steers gets no curve tighter than its turning radius.

        Raises:
            SimError: if the goal is not two finite numbers or ``dt_s`` is not positive.
        """
        goal_odom_m = finite_array("goal_odom_m", goal_odom_m, (2,), SimError)
        dt_s = finite_number("dt_s", dt_s, SimError, minimum=0.0, exclusive_minimum=True)
        goal_x_m, goal_y_m = _in_base(robot_state, goal_odom_m)
        goal_distance_m = math.hypot(goal_x_m, goal_y_m)
        limits = TwistLimits.of(self.robot, self.config, constraints)
        if limits.speed_mps <= 0.0 or goal_distance_m <= self.config.goal_tolerance_m:
            return self._brake(robot_state, dt_s)

        gentle_mps2 = self.config.goal_deceleration_fraction * self.robot.max_deceleration_mps2
        top_mps = min(limits.speed_mps, math.sqrt(2.0 * gentle_mps2 * goal_distance_m))
        reach_m = max(robot_state.speed_mps, top_mps) * self.config.horizon_s
        scene = Scene(robot_state, constraints, self._boxes_within(robot_state, reach_m))
        bearing_rad = self._bearing(goal_x_m, goal_y_m, scene)
        candidates = self._sampler.candidates(robot_state, limits, top_mps, bearing_rad, dt_s)
        speeds, yaw_rates, index = candidates.distinct()
        safe = np.append(self._safe(speeds, yaw_rates, robot_state, dt_s, scene), False)
        if not safe.any():
            return self._brake(robot_state, dt_s)
        cost = self._cost(candidates, robot_state, (goal_distance_m, bearing_rad), scene)
        cost[~safe[index]] = np.inf
        row, column = divmod(int(np.argmax(cost <= cost.min() + _TIE)), cost.shape[1])
        return (
            float(candidates.speed_commands_mps[row, column]),
            float(candidates.yaw_commands_radps[row, column]),
        )

    def _brake(self, robot_state: RobotState, dt_s: float) -> tuple[float, float]:
        """Return full braking along the present curve, as far as the yaw acceleration allows."""
        speed, yaw_rate = max(robot_state.speed_mps, 0.0), robot_state.yaw_rate_radps
        stop_s = speed / self.robot.max_deceleration_mps2
        yaw_stop_s = stop_s if self._steers else float(self._yaw_stop_s(stop_s, yaw_rate))
        return (
            speed * (1.0 - dt_s / stop_s) if stop_s > dt_s else 0.0,
            yaw_rate * (1.0 - dt_s / yaw_stop_s) if yaw_stop_s > dt_s else 0.0,
        )

    def _yaw_stop_s(self, stop_s: ArrayLike, yaw_rate: ArrayLike) -> FloatArray:
        """Return the time in which a turn ends: with the speed, or later if it has to."""
        own_s = np.abs(yaw_rate) / self.config.max_yaw_acceleration_radps2
        return np.asarray(np.maximum(stop_s, own_s))

    def _bearing(self, goal_x_m: float, goal_y_m: float, scene: Scene) -> float:
        """Return the bearing of the goal, or past a person who stands in front of it."""
        bearing_rad = math.atan2(goal_y_m, goal_x_m)
        if bearing_rad > math.pi - 1e-6:  # behind: turn the same way whatever the rounding
            bearing_rad -= math.tau
        config = self.config
        margin_m = self._footprint.half_size_m[1] + config.clearance_m + config.detour_margin_m
        discs = scene.standing_discs_m(config.standing_speed_mps, margin_m)
        if not discs:
            return bearing_rad

        c, s = math.cos(bearing_rad), math.sin(bearing_rad)

        def is_free(x_m: float, y_m: float) -> bool:
            pose = Poses(*(np.asarray(value) for value in (x_m, y_m, c, s)))
            return bool(scene.box_gap_m(self._footprint.at(pose)) >= config.clearance_m)

        goal_distance_m = math.hypot(goal_x_m, goal_y_m)
        return detour_bearing_rad(bearing_rad, goal_distance_m, discs, is_free)

    def _boxes_within(self, robot_state: RobotState, reach_m: float) -> FloatArray:
        """Return the boxes within reach of a roll-out of length ``reach_m``, or of full braking."""
        boxes = self._boxes_odom_m
        if not len(boxes):
            return boxes
        braking_m = 0.5 * robot_state.speed_mps**2 / self.robot.max_deceleration_mps2
        margin_m = max(self.config.static_comfort_m, self.config.clearance_m)
        near_m = max(reach_m, braking_m) + self._footprint.reach_m + margin_m
        position = robot_state.position_odom_m
        apart = np.maximum(boxes[:, :2] - position, position - boxes[:, 2:]).max(axis=1)
        return np.asarray(boxes[apart <= near_m])

    def _safe(
        self,
        speeds: FloatArray,
        yaw_rates: FloatArray,
        state: RobotState,
        dt_s: float,
        scene: Scene,
    ) -> NDArray[np.bool_]:
        """Return whether one tick of a command and then full braking keep the clearance.

        Args:
            speeds: (N,) speeds of the commands.
            yaw_rates: (N,) their yaw rates.
            state: the robot now.
            dt_s: length of a tick.
            scene: people and boxes.
        """
        safe = np.ones((1, len(speeds)), dtype=bool)
        if not (scene.has_people or scene.has_boxes):
            return safe.ravel()
        v, w = speeds[None], yaw_rates[None]
        yaw_acceleration = self.config.max_yaw_acceleration_radps2
        stop_s = v / self.robot.max_deceleration_mps2
        yaw_stop_s = stop_s if self._steers else self._yaw_stop_s(stop_s, w)
        t_s = dt_s + yaw_stop_s * self._braking_share
        # During the tick the speed lies between the present one and the command: take the larger.
        extra_m = np.maximum(state.speed_mps - v, 0.0) * dt_s
        # The yaw rate ramps from the present one.
        change = state.yaw_rate_radps - w
        extra_rad = 0.5 * change * np.minimum(np.abs(change) / yaw_acceleration, dt_s)
        path_m = stopping_integral(v, stop_s, dt_s, t_s) + extra_m
        poses = follow_arcs(path_m, stopping_integral(w, yaw_stop_s, dt_s, t_s) + extra_rad)
        # A robot that never reverses must not drive to where it cannot turn on the spot.
        margin_m = np.where(v > 0.0, self._footprint.turning_margin_m, 0.0)
        moving = self._footprint.at(poses, margin_m)
        waiting = self._footprint.at(_STANDING, margin_m)
        clearance_m = self.config.clearance_m
        near_m = float(path_m[-1].max()) + self._footprint.reach_m + clearance_m + _FAR_M
        scene = scene.within(near_m + self._footprint.turning_margin_m, float(t_s[-1].max()))
        if scene.has_people:
            # The present gap to people is measured without this margin: else it could be used up.
            still = self._footprint.at(_STANDING)
            enough = np.minimum(clearance_m, scene.people_gap_m(still, t_s) - _SLACK_M)
            safe &= (scene.people_gap_m(moving, t_s) >= enough).all(axis=(0, 1))
            # Turning on the spot is always allowed: the corners stay within the turning circle and
            # the speed limit.
            safe |= v <= 0.0
        if scene.has_boxes:
            enough = np.minimum(clearance_m, scene.box_gap_m(waiting) - _SLACK_M)
            safe &= (scene.box_gap_m(moving) >= enough).all(axis=0)
        return safe.ravel()

    def _cost(
        self,
        candidates: Candidates,
        robot_state: RobotState,
        goal: tuple[float, float],
        scene: Scene,
    ) -> FloatArray:
        """Return the cost (V, W) of each candidate over the horizon, dimensionless.

        ``goal`` is the distance to it (m) and the bearing to head for (rad).
        """
        config, t_s = self.config, self._t_s
        goal_distance_m, bearing_rad = goal
        path, turn = self._roll_out(candidates, robot_state)
        # A roll-out ends when it is as long as the distance to the goal.
        path = np.minimum(path, goal_distance_m)
        poses = follow_arcs(path, turn)

        cost = self._goal_cost(poses, goal_distance_m, bearing_rad)
        turning = candidates.yaw_rates_radps / config.max_yaw_rate_radps
        change = turning - robot_state.yaw_rate_radps / config.max_yaw_rate_radps
        cost += config.turn_weight * turning**2 + config.smoothness_weight * np.abs(change)
        rectangles = self._footprint.at(poses)
        # Whoever stays farther away than any comfort has no cost.
        comfort_m = max(config.person_comfort_m, config.room_m, config.static_comfort_m)
        near_m = float(path[-1].max()) + self._footprint.reach_m + comfort_m + _FAR_M
        among_people = scene.has_people
        scene = scene.within(near_m, config.horizon_s + config.front_time_s)
        if scene.has_people:
            close = _closeness(scene.people_gap_m(rectangles, t_s), config.person_comfort_m)
            strip_gap = scene.strip_gap_m(rectangles, t_s, config.front_time_s)
            ahead = _closeness(strip_gap, config.person_comfort_m)
            worst = config.person_weight * close + config.front_weight * ahead
            weighted = worst * self._late_people
            # The worst moment decides; the mean leads a robot inside a disc out of it.
            cost += (weighted.max(axis=1) + weighted.sum(axis=1) / len(t_s)).sum(axis=0)
            gaps_m = scene.body_gap_m(rectangles, t_s, config.standing_speed_mps)
            if len(gaps_m):
                near = (_closeness(gaps_m, config.room_m).sum(axis=1) / len(t_s)).max(axis=0)
                # Compares yaw rates at equal speed only: the speed limit slows the robot already.
                cost += config.room_weight * (near - near.min(axis=1, keepdims=True))
        if among_people:
            cost += config.keep_right_weight * np.maximum(turning, 0.0)
        if scene.has_boxes:
            close = _closeness(scene.box_gap_m(rectangles), config.static_comfort_m)
            worst_box = (close * self._late_static).max(axis=0)
            if abs(robot_state.speed_mps) < _STANDING_MPS:
                # A turn on the spot leads out: the swing of its corners costs nothing.
                now = scene.box_gap_m(self._footprint.at(_STANDING))
                worst_box[0] = _closeness(now, config.static_comfort_m)
            cost += config.static_weight * worst_box
        return cost

    def _roll_out(
        self, candidates: Candidates, robot_state: RobotState
    ) -> tuple[FloatArray, FloatArray]:
        """Return the paths (T, V, W) in metres and the headings of the candidates.

        The headings, (K, V, W) or (K, 1, W), end with the sample from which on they stay, as in
        :func:`follow_arcs`.
        """
        robot, speed = self.robot, robot_state.speed_mps
        faster, slower = robot.max_acceleration_mps2, robot.max_deceleration_mps2
        slow, w = candidates.turn_speeds_mps, candidates.yaw_rates_radps
        rate = np.where(slow > speed, faster, slower)
        turning_m = ramp_integral(speed, slow, rate, self._turn_t_s)
        end_s = self.config.turn_time_s
        after = clip_to_window(slow, speed, slower * end_s, faster * end_s)
        rate = np.where(candidates.speeds_mps > after, faster, slower)
        path = turning_m + ramp_integral(
            after, candidates.speeds_mps, rate, self._t_s - self._turn_t_s
        )
        if self._steers:
            return path, turning_m[self._turning] * (w / np.maximum(slow, _STANDING_MPS))
        acceleration = self.config.max_yaw_acceleration_radps2
        turning_s = self._turn_t_s[self._turning]
        # The yaw rates are the same for all speeds.
        return path, ramp_integral(robot_state.yaw_rate_radps, w[:1], acceleration, turning_s)

    def _goal_cost(self, poses: Poses, goal_distance_m: float, bearing_rad: float) -> FloatArray:
        """Return the cost (V, W) of mean distance to the goal and of facing away from it."""
        to_x = goal_distance_m * math.cos(bearing_rad) - poses.x_m
        to_y = goal_distance_m * math.sin(bearing_rad) - poses.y_m
        distance = np.sqrt(to_x * to_x + to_y * to_y)
        full_gain_m = 0.5 * self.robot.max_speed_mps * self.config.horizon_s
        farther_m = distance.sum(axis=0) / len(distance) - goal_distance_m
        c, s = poses.cos_heading[-1], poses.sin_heading[-1]
        off_rad = np.arctan2(to_y[-1] * c - to_x[-1] * s, to_x[-1] * c + to_y[-1] * s)
        # At the goal there is no direction to face.
        away = np.minimum(distance[-1] / self.config.goal_tolerance_m, 1.0)
        facing = (self.config.heading_weight / math.pi) * np.abs(off_rad) * away
        return np.asarray(farther_m / full_gain_m + facing)


def _in_base(robot_state: RobotState, point_odom_m: FloatArray) -> tuple[float, float]:
    x, y = (point_odom_m - robot_state.position_odom_m).tolist()
    c, s = math.cos(robot_state.heading_odom_rad), math.sin(robot_state.heading_odom_rad)
    return c * x + s * y, c * y - s * x


def _closeness(gap_m: FloatArray, comfort_m: float) -> FloatArray:
    """Return 0 for gaps from ``comfort_m``, rising quadratically to 1 at contact, and 1 inside."""
    share = np.minimum(np.maximum(1.0 - gap_m / comfort_m, 0.0), 1.0)
    return np.asarray(share * share)


def _checked_boxes(boxes: ArrayLike | None) -> FloatArray:
    if boxes is None:
        return np.zeros((0, 4))
    checked = finite_array("static_boxes_odom_m", boxes, ("N", 4), SimError)
    wrong = np.flatnonzero((checked[:, :2] >= checked[:, 2:]).any(axis=1))
    if len(wrong):
        row = int(wrong[0])
        raise SimError(
            "static_boxes_odom_m must hold x_min < x_max and y_min < y_max in metres, "
            f"row {row} is {checked[row].tolist()}"
        )
    return checked
