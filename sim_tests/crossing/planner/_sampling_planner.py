"""The reference local planner: a dynamic-window planner among moving people and fixed boxes."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.arrays import FloatArray, boxes_on_floor, finite_array, finite_number

from ...world.errors import SimError
from ._candidates import Aim, Candidates, Motion, TwistLimits, along_time, within_next_limits
from ._config import PlannerConfig
from ._detour import detour_bearing_rad
from ._give_way import Way, giving_way_mps
from ._reversing import REVERSE_MPS, Reversing, goal_facing
from ._rollout import Poses
from ._scene import FootprintBox, Scene
from ._sideways import SidewaysMotion
from ._steered import SteeredMotion
from ._waiting import Waiting

# Tolerance for rounding when a motion is compared with waiting.
_SLACK_M: Final = 1e-5
# Costs closer than this are equal; the order of the samples then decides, not the rounding.
_TIE: Final = 1e-9
# A robot that steers turns back, whatever the way costs, to a goal beyond this bearing.
_BEHIND_RAD: Final = 1.75
_TURN_BACK: Final = 10.0
# Added to the distances from which on people and boxes do not count, against rounding.
_FAR_M: Final = 0.01
# A slower robot counts as standing.
_STANDING_MPS: Final = 0.02
_STANDING: Final = Poses(*(np.asarray(value) for value in (0.0, 0.0, 1.0, 0.0)))


class SamplingPlanner:
    """A dynamic-window planner (Fox, Burgard and Thrun 1997) for every drive of a profile.

    It drives to a goal among moving people and fixed boxes. A candidate is a final speed after a
    turn that is held for a while, on a curve that the robot can drive; of a holonomic robot it is a
    velocity in one direction. Each is rolled out in closed form and judged twice:

    * It must be *safe*: one tick of it followed by full braking keeps ``clearance_m`` to every box
      and, until the robot stands, to every person's disc moving on at constant velocity. Where that
      gap is already gone, because a radius grew or a person walked up, motion that leaves at least
      the gap that waiting would leave is safe too, so that the robot can get out. A moving robot
      keeps enough distance ahead to turn on the spot; near people a standing robot always may.
    * It should be *good*: near the goal soon, facing it, away from people, boxes and the strip that
      a walking person is about to use, at a distance from people's bodies, without needless
      turning. If someone stands in front of the goal, the robot heads for the tangent past them.

    If nothing is safe the robot brakes as hard as it may along its present curve. Only a robot that
    steers reverses, at 0.3 m/s and less, out of a place where no arc ahead is free of boxes, or
    where its goal lies beside it. Apart from that the command depends only on the arguments. People
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
        boxes = np.zeros((0, 4)) if static_boxes_odom_m is None else static_boxes_odom_m
        self._boxes_odom_m = boxes_on_floor("static_boxes_odom_m", boxes, SimError)

        samples = max(2, math.ceil(config.horizon_s / config.step_s))
        self._t_s = along_time(config.horizon_s / samples, config.horizon_s, samples)
        self._late_people = along_time(1.0, config.late_weight, samples)
        self._late_static = along_time(1.0, config.late_static_weight, samples)
        self._motion: Motion = (
            SidewaysMotion(robot, config)
            if robot.drive == "holonomic"
            else SteeredMotion(robot, config)
        )
        self._turns_on_the_spot = robot.drive in (None, "differential")
        self._waiting = Waiting()
        self._reversing: Reversing | None = None
        if robot.min_turning_radius_m is not None:
            self._reversing = Reversing(
                robot, self._footprint, config.clearance_m, config.goal_tolerance_m
            )

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: ArrayLike,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, ...]:
        """Choose the command for the next tick.

        Args:
            robot_state: state of the robot.
            goal_odom_m: (2,) goal of its base origin.
            constraints: people as discs and the speed limit, at the time of the state.
            dt_s: time for which the command is held, > 0.

        Returns:
            ``(speed_mps, yaw_rate_radps)``, of a holonomic robot ``(forward_mps, left_mps,
            yaw_rate_radps)``. The robot can reach the speed in ``dt_s``. It is negative only for a
            robot that steers. It is above ``constraints.speed_limit_mps`` only where full braking
            does not get below the limit in one tick. With the yaw rate, |v| + |ω| R obeys
            ``constraints.fastest_point_limit_mps`` (R is the circumscribed radius), with the same
            exception. Under constraints of ``NavAdapter`` it also obeys the limits of the next two
            ticks, as they are foreseen. A robot that steers gets no curve tighter than its turning
            radius.

        Raises:
            SimError: if the goal is not two finite numbers or ``dt_s`` is not positive.
        """
        goal_odom_m = finite_array("goal_odom_m", goal_odom_m, (2,), SimError)
        dt_s = finite_number("dt_s", dt_s, SimError, minimum=0.0, exclusive_minimum=True)
        goal = Aim.at(goal_odom_m, robot_state)
        limits = TwistLimits.of(self.robot, self.config, constraints)
        if limits.speed_mps <= 0.0 or goal.distance_m <= self.config.goal_tolerance_m:
            return self._motion.brake(robot_state, dt_s)

        gentle_mps2 = self.config.goal_deceleration_fraction * self.robot.max_deceleration_mps2
        top_mps = min(limits.speed_mps, math.sqrt(2.0 * gentle_mps2 * goal.distance_m))
        reach_m = max(robot_state.travel_mps, top_mps) * self.config.horizon_s
        reach_m = max(reach_m, self.robot.min_turning_radius_m or 0.0)
        scene = Scene(robot_state, constraints, self._boxes_within(robot_state, reach_m))
        aim = Aim(goal.distance_m, self._past_standing_rad(goal, scene))
        if scene.has_people and self.config.give_way_s > 0.0:
            top_mps = giving_way_mps(
                self._way(aim),
                scene.people,
                top_mps,
                crossing_mps=self.config.crossing_speed_mps,
                within_s=self.config.give_way_s,
            )
        reversing = self._reversing
        if reversing is not None and reversing.wanted(robot_state, aim, scene, dt_s):
            command = self._reverse(robot_state, limits, aim, dt_s, scene)
            return within_next_limits(command, robot_state, constraints, dt_s)
        command = self._choose(robot_state, limits, top_mps, aim, dt_s, scene)
        if self._waiting.goes_on(robot_state, command, top_mps, dt_s):
            command = self._choose(robot_state, limits, top_mps, aim, dt_s, scene, room_weight=0.0)
        if reversing is not None and reversing.has_stood(robot_state, command[0], dt_s):
            alone = scene.without_people()
            if self._choose(robot_state, limits, top_mps, aim, dt_s, alone)[0] <= _STANDING_MPS:
                reversing.begin()  # not people, but boxes are in the way
        if self._must_turn_round(robot_state, command, goal):
            command = self._face(robot_state, limits, goal, dt_s, scene)
        return within_next_limits(command, robot_state, constraints, dt_s)

    def _choose(
        self,
        robot_state: RobotState,
        limits: TwistLimits,
        top_mps: float,
        aim: Aim,
        dt_s: float,
        scene: Scene,
        room_weight: float | None = None,
    ) -> tuple[float, ...]:
        """Return the command of the best candidate that is safe, or full braking."""
        candidates = self._motion.candidates(robot_state, limits, top_mps, aim, dt_s)
        weight = self.config.room_weight if room_weight is None else room_weight
        cost = partial(self._cost, candidates, robot_state, aim, scene, weight)
        return self._cheapest_safe(candidates, cost, robot_state, dt_s, scene)

    def _must_turn_round(
        self, robot_state: RobotState, command: tuple[float, ...], goal: Aim
    ) -> bool:
        """Return whether the robot stands, and stays, with its goal behind it.

        No roll-out leads there, and the swing of the corners near people may cost more than the
        first part of the turn gains. So a robot amid a group would stand for ever.
        """
        return (
            self._turns_on_the_spot
            and abs(goal.bearing_rad) > _BEHIND_RAD
            and max(robot_state.travel_mps, command[0]) <= _STANDING_MPS
        )

    def _face(
        self,
        robot_state: RobotState,
        limits: TwistLimits,
        goal: Aim,
        dt_s: float,
        scene: Scene,
    ) -> tuple[float, ...]:
        """Return the safe turn on the spot that leads to the goal, or full braking."""
        candidates = self._motion.candidates(robot_state, limits, 0.0, goal, dt_s)
        cost = partial(self._goal_cost, candidates, goal)
        return self._cheapest_safe(candidates, cost, robot_state, dt_s, scene)

    def _reverse(
        self,
        robot_state: RobotState,
        limits: TwistLimits,
        aim: Aim,
        dt_s: float,
        scene: Scene,
    ) -> tuple[float, ...]:
        """Return the command backward that turns the robot most to its goal, or full braking."""
        assert isinstance(self._motion, SteeredMotion)
        top_mps = min(REVERSE_MPS, limits.speed_mps)
        candidates = self._motion.backward(robot_state, limits, top_mps, aim, dt_s)

        def cost() -> FloatArray:
            cost = goal_facing(candidates.poses, aim)
            if scene.has_boxes:
                gaps_m = scene.box_gap_m(self._footprint.at(candidates.poses))
                cost = cost + _closeness(gaps_m, self.config.static_comfort_m).max(axis=0)
            cost[0] += math.tau  # rather slowly than not at all
            return cost

        return self._cheapest_safe(candidates, cost, robot_state, dt_s, scene)

    def _cheapest_safe(
        self,
        candidates: Candidates,
        cost_of_all: Callable[[], FloatArray],
        robot_state: RobotState,
        dt_s: float,
        scene: Scene,
    ) -> tuple[float, ...]:
        """Return the safe command that costs least, the first of equal ones, or full braking."""
        safe = self._safe(candidates, robot_state, dt_s, scene)
        if not safe.any():
            return self._motion.brake(robot_state, dt_s)
        cost = cost_of_all()
        cost[~safe] = np.inf
        row, column = divmod(int(np.argmax(cost <= cost.min() + _TIE)), cost.shape[1])
        return tuple(candidates.commands[row, column].tolist())

    def _past_standing_rad(self, goal: Aim, scene: Scene) -> float:
        """Return the bearing of the goal, or past a person who stands in front of it."""
        bearing_rad = goal.bearing_rad
        config = self.config
        margin_m = self._footprint.half_size_m[1] + config.clearance_m + config.detour_margin_m
        discs = scene.standing_discs_m(config.standing_speed_mps, margin_m)
        if not discs:
            return bearing_rad

        c, s = math.cos(bearing_rad), math.sin(bearing_rad)
        around = scene.among(self._boxes_odom_m)  # the way past may lie beyond a roll-out

        def is_free(x_m: float, y_m: float) -> bool:
            pose = Poses(*(np.asarray(value) for value in (x_m, y_m, c, s)))
            return bool(around.box_gap_m(self._footprint.at(pose)) >= config.clearance_m)

        return detour_bearing_rad(bearing_rad, goal.distance_m, discs, is_free)

    def _way(self, aim: Aim) -> Way:
        """Return the strip in which the robot drives to its aim."""
        box = self._footprint
        return Way(
            aim.bearing_rad,
            aim.distance_m,
            box.half_size_m[1] + self.config.clearance_m,
            box.center_m[0] + box.half_size_m[0],
            box.half_size_m[0] - box.center_m[0],
        )

    def _boxes_within(self, robot_state: RobotState, reach_m: float) -> FloatArray:
        """Return the boxes within reach of a roll-out of length ``reach_m``, or of full braking."""
        boxes = self._boxes_odom_m
        if not len(boxes):
            return boxes
        braking_m = 0.5 * robot_state.travel_mps**2 / self.robot.max_deceleration_mps2
        margin_m = max(self.config.static_comfort_m, self.config.clearance_m)
        near_m = max(reach_m, braking_m) + self._footprint.reach_m + margin_m
        position = robot_state.position_odom_m
        apart = np.maximum(boxes[:, :2] - position, position - boxes[:, 2:]).max(axis=1)
        return np.asarray(boxes[apart <= near_m])

    def _safe(
        self,
        candidates: Candidates,
        state: RobotState,
        dt_s: float,
        scene: Scene,
    ) -> NDArray[np.bool_]:
        """Return (V, W) whether one tick of a command and then full braking keep the clearance."""
        commands, index = candidates.distinct()
        safe = np.ones((1, len(commands)), dtype=bool)
        if not (scene.has_people or scene.has_boxes):
            return np.asarray(np.append(safe.ravel(), False)[index])
        poses, t_s = self._motion.stopping(commands, state, dt_s)
        # A robot that never reverses must not drive to where it cannot turn on the spot.
        turning_m = self._footprint.turning_margin_m if self._turns_on_the_spot else 0.0
        margin_m = np.where(commands[None, :, 0] > 0.0, turning_m, 0.0)
        moving = self._footprint.at(poses, margin_m)
        waiting = self._footprint.at(_STANDING, margin_m)
        clearance_m = self.config.clearance_m
        near_m = _reach_m(poses) + self._footprint.reach_m + turning_m + clearance_m + _FAR_M
        scene = scene.within(near_m, float(t_s[-1].max()))
        if scene.has_people:
            # The present gap to people is measured without this margin: else it could be used up.
            still = self._footprint.at(_STANDING)
            enough = np.minimum(clearance_m, scene.people_gap_m(still, t_s) - _SLACK_M)
            safe &= (scene.people_gap_m(moving, t_s) >= enough).all(axis=(0, 1))
            # Turning on the spot is always allowed: the corners stay within the turning circle and
            # the speed limit.
            safe |= (commands[None, :, :-1] == 0.0).all(axis=-1)
        if scene.has_boxes:
            enough = np.minimum(clearance_m, scene.box_gap_m(waiting) - _SLACK_M)
            safe &= (scene.box_gap_m(moving) >= enough).all(axis=0)
        return np.asarray(np.append(safe.ravel(), False)[index])

    def _cost(
        self,
        candidates: Candidates,
        robot_state: RobotState,
        aim: Aim,
        scene: Scene,
        room_weight: float,
    ) -> FloatArray:
        """Return the cost (V, W) of each candidate over the horizon, dimensionless."""
        config, t_s = self.config, self._t_s
        poses, turning = candidates.poses, candidates.turning
        cost = self._goal_cost(candidates, aim)
        change = turning - candidates.turning_now
        cost += config.turn_weight * turning**2 + config.smoothness_weight * np.abs(change)
        rectangles = self._footprint.at(poses)
        # Whoever stays farther away than any comfort has no cost.
        comfort_m = max(config.person_comfort_m, config.room_m, config.static_comfort_m)
        near_m = _reach_m(poses) + self._footprint.reach_m + comfort_m + _FAR_M
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
                cost += room_weight * (near - near.min(axis=1, keepdims=True))
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

    def _goal_cost(self, candidates: Candidates, aim: Aim) -> FloatArray:
        """Return the cost (V, W) of mean distance to the goal and of going away from it."""
        poses = candidates.poses
        to_x = aim.distance_m * math.cos(aim.bearing_rad) - poses.x_m
        to_y = aim.distance_m * math.sin(aim.bearing_rad) - poses.y_m
        distance = np.sqrt(to_x * to_x + to_y * to_y)
        full_gain_m = 0.5 * self.robot.max_speed_mps * self.config.horizon_s
        farther_m = distance.sum(axis=0) / len(distance) - aim.distance_m
        c, s = candidates.course
        off_rad = np.arctan2(to_y[-1] * c - to_x[-1] * s, to_x[-1] * c + to_y[-1] * s)
        # At the goal there is no direction to face.
        away = np.minimum(distance[-1] / self.config.goal_tolerance_m, 1.0)
        weight = self.config.heading_weight / math.pi
        if self._reversing is not None and abs(aim.bearing_rad) > _BEHIND_RAD:
            weight *= _TURN_BACK  # its turn leads away from the goal at first
        facing = weight * np.abs(off_rad) * away
        return np.asarray(farther_m / full_gain_m + facing)


def _reach_m(poses: Poses) -> float:
    """Return a distance from the origin that no pose exceeds."""
    return float(np.abs(poses.x_m).max() + np.abs(poses.y_m).max())


def _closeness(gap_m: FloatArray, comfort_m: float) -> FloatArray:
    """Return 0 for gaps from ``comfort_m``, rising quadratically to 1 at contact, and 1 inside."""
    share = np.minimum(np.maximum(1.0 - gap_m / comfort_m, 0.0), 1.0)
    return np.asarray(share * share)
