"""The dynamic window: it follows an aim among moving people and fixed boxes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nav_adapter import NavConstraints, RobotProfile, RobotState
from nav_adapter.motion import clip_twists_ahead
from perception.arrays import FloatArray, boxes_on_floor, finite_array, finite_number

from ...world.errors import SimError
from ._drives import Candidates, Drive, Sideways, Tick, TwistLimits, Wheels
from ._geometry import FootprintBox
from ._reversing import REVERSE_MPS, Reversing
from ._sampling import CLEARANCE_M, GOAL_TOLERANCE_M, Sampling, along_time
from ._scene import STANDING, Aim, Scene

# Costs have no dimension. One unit is the gain of driving straight to a far goal at the robot's
# maximum speed over standing still. Facing away from the goal (by π) at the end of the roll-out
# costs this much, touching a person or a box now, turning at 1.2 rad/s, and changing the yaw rate
# by as much.
_HEADING: Final = 0.3
_PERSON: Final = 1.5
_BOX: Final = 0.5
_TURN: Final = 0.02
_SMOOTHNESS: Final = 0.05
# Weight of closeness to people at the end of the horizon, relative to closeness now. That of boxes
# is 0: the robot will turn again before it is there.
_LATE: Final = 0.3
# Share of the robot's deceleration with which it arrives at the goal; the rest is in reserve.
_GENTLE: Final = 0.6
# Tolerance for rounding when a motion is compared with waiting.
_SLACK_M: Final = 1e-5
# Costs closer than this are equal; the order of the samples then decides, not the rounding.
_TIE: Final = 1e-9
# A robot that steers turns back, whatever the way costs, to a goal beyond this bearing.
_BEHIND_RAD: Final = 1.75
_TURN_BACK: Final = 10.0
# A slower robot counts as standing.
_STANDING_MPS: Final = 0.02
_Cost = Callable[[Tick, Candidates], FloatArray]


class DynamicWindow:
    """A dynamic window (Fox, Burgard and Thrun 1997) for every drive of a profile.

    It drives to an aim among moving people and fixed boxes; by itself it goes straight to the goal.
    A candidate is a final speed after a turn that is held for a while, on a curve that the robot
    can drive; of a holonomic robot it is a velocity in one direction. Each is rolled out in closed
    form and judged twice:

    * It must be *safe*: one tick of it followed by full braking keeps 0.05 m to every box and,
      until the robot stands, to every person's disc moving on at constant velocity. Where that gap
      is already gone, because a radius grew or a person walked up, motion that leaves at least the
      gap that waiting would leave is safe too, so that the robot can get out. A moving robot keeps
      enough distance ahead to turn on the spot; near people a standing robot always may.
    * It should be *good*: near the aim soon, facing it, away from people and boxes, without
      needless turning.

    If nothing is safe the robot brakes as hard as it may along its present curve. Only a robot that
    steers reverses, at 0.3 m/s and less, out of a place where no arc ahead is free of boxes, or
    where its goal lies beside it. Apart from that the command depends only on the arguments. People
    and goal are judged in the robot's frame, so turning or shifting the world changes nothing.

    Args:
        robot: footprint and limits. The footprint counts with its bounding rectangle.
        static_boxes_odom_m: (N, 4) fixed obstacles x_min, y_min, x_max, y_max; None for none.

    Attributes:
        person_comfort_m: gap to a person's radius below which closeness costs.
        box_comfort_m: the same of a box.

    Raises:
        SimError: if the boxes are not finite or a minimum is not below its maximum.
    """

    person_comfort_m = 0.40
    box_comfort_m = 0.25

    def __init__(self, robot: RobotProfile, static_boxes_odom_m: ArrayLike | None = None) -> None:
        self.robot = robot
        self._sampling = sampling = Sampling.of(robot)
        self._footprint = FootprintBox.of(robot)
        boxes = np.zeros((0, 4)) if static_boxes_odom_m is None else static_boxes_odom_m
        checked = boxes_on_floor("static_boxes_odom_m", boxes, SimError)
        self._boxes_odom_m = tuple(map(tuple, checked.tolist()))

        self._t_s = sampling.times_s
        self._late_people = along_time(1.0, _LATE, len(self._t_s))
        self._late_boxes = along_time(1.0, 0.0, len(self._t_s))
        self._wheels = None if robot.drive == "holonomic" else Wheels(robot, sampling)
        self._drive: Drive = self._wheels or Sideways(robot, sampling)
        self._turns_on_the_spot = robot.drive in (None, "differential")
        self._reversing: Reversing | None = None
        if robot.min_turning_radius_m is not None:
            self._reversing = Reversing(robot.min_turning_radius_m, self._footprint)

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: ArrayLike,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, ...]:
        """Choose the command for the next tick.

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
        limits = self._limits(constraints)
        if limits.speed_mps <= 0.0 or goal.distance_m <= GOAL_TOLERANCE_M:
            return self._drive.brake(robot_state, dt_s)
        scene = Scene.around(robot_state, constraints, self._boxes_odom_m)
        straight = Tick(robot_state, limits, self._top_mps(limits, goal), goal, dt_s, scene)
        command = self._command(self._headed(straight, goal_odom_m, constraints), goal)
        return within_next_limits(command, robot_state, constraints, dt_s)

    def _headed(self, tick: Tick, goal_odom_m: FloatArray, constraints: NavConstraints) -> Tick:
        """Return the tick with the place to head for on the way to the goal."""
        return tick

    def _limits(self, constraints: NavConstraints) -> TwistLimits:
        """Return the twists that the robot may have now."""
        assert constraints.fastest_point_limit_mps is not None
        robot = self.robot
        return TwistLimits(
            min(constraints.speed_limit_mps, robot.max_speed_mps),
            constraints.fastest_point_limit_mps,
            self._sampling.yaw_rate_radps,
            robot.circumscribed_radius_m,
            math.inf if robot.min_turning_radius_m is None else 1.0 / robot.min_turning_radius_m,
        )

    def _top_mps(self, limits: TwistLimits, goal: Aim) -> float:
        """Return the highest speed from which the robot arrives gently."""
        gentle_mps2 = _GENTLE * self.robot.max_deceleration_mps2
        return min(limits.speed_mps, math.sqrt(2.0 * gentle_mps2 * goal.distance_m))

    def _command(self, tick: Tick, goal: Aim) -> tuple[float, ...]:
        """Return the command of a tick: of the best candidate, or of a way out of a standstill."""
        reversing = self._reversing
        if reversing is not None and self._wheels is not None and reversing.wanted(tick):
            back = tick._replace(top_mps=min(REVERSE_MPS, tick.limits.speed_mps))
            return self._cheapest_safe(back, self._wheels.backward(back), self._backing_cost)
        command = self._choose(tick)
        if reversing is not None and reversing.has_stood(tick, command):
            alone = tick._replace(scene=replace(tick.scene, people=()))
            if self._choose(alone)[0] <= _STANDING_MPS:
                reversing.begin()  # not people, but boxes are in the way
        if (
            self._turns_on_the_spot
            and abs(goal.bearing_rad) > _BEHIND_RAD
            and max(tick.state.travel_mps, command[0]) <= _STANDING_MPS
        ):
            # The robot stands, and stays, with its goal behind it. No roll-out leads there, and the
            # swing of the corners near people may cost more than the first part of the turn gains.
            # So it turns on the spot: amid a group it would stand for ever.
            turn = tick._replace(top_mps=0.0, aim=goal)
            return self._cheapest_safe(turn, self._drive.candidates(turn), self._goal_cost)
        return command

    def _choose(self, tick: Tick) -> tuple[float, ...]:
        """Return the command of the best candidate that is safe, or full braking."""
        return self._cheapest_safe(tick, self._drive.candidates(tick), self._cost)

    def _cheapest_safe(
        self, tick: Tick, candidates: Candidates, cost_of: _Cost
    ) -> tuple[float, ...]:
        """Return the safe command that costs least, the first of equal ones, or full braking."""
        safe = self._safe(tick, candidates)
        if not safe.any():
            return self._drive.brake(tick.state, tick.dt_s)
        cost = cost_of(tick, candidates)
        cost[~safe] = np.inf
        row, column = divmod(int(np.argmax(cost <= cost.min() + _TIE)), cost.shape[1])
        return tuple(candidates.commands[row, column].tolist())

    def _safe(self, tick: Tick, candidates: Candidates) -> NDArray[np.bool_]:
        """Return (V, W) whether one tick of a command and then full braking keep the clearance."""
        commands, index = candidates.distinct()
        safe = np.ones((1, len(commands)), dtype=bool)
        poses, t_s = self._drive.stopping(commands, tick)
        # A robot that never reverses must not drive to where it cannot turn on the spot.
        turning_m = self._footprint.turning_margin_m if self._turns_on_the_spot else 0.0
        margin_m = np.where(commands[None, :, 0] > 0.0, turning_m, 0.0)
        moving = self._footprint.at(poses, margin_m)
        near_m = self._footprint.reach_m + turning_m + CLEARANCE_M
        scene = tick.scene.near(poses, near_m, float(t_s[-1].max()))
        if scene.people:
            # The present gap to people is measured without this margin: else it could be used up.
            still = self._footprint.at(STANDING)
            enough = np.minimum(CLEARANCE_M, scene.people_gap_m(still, t_s) - _SLACK_M)
            safe &= (scene.people_gap_m(moving, t_s) >= enough).all(axis=(0, 1))
            # Turning on the spot is always allowed: the corners stay within the turning circle and
            # the speed limit.
            safe |= (commands[None, :, :-1] == 0.0).all(axis=-1)
        if scene.boxes_odom_m:
            waiting = self._footprint.at(STANDING, margin_m)
            enough = np.minimum(CLEARANCE_M, scene.box_gap_m(waiting) - _SLACK_M)
            safe &= (scene.box_gap_m(moving) >= enough).all(axis=0)
        return np.asarray(safe[0, index] & candidates.allowed)

    def _cost(self, tick: Tick, candidates: Candidates) -> FloatArray:
        """Return the cost (V, W) of each candidate over the horizon, dimensionless."""
        poses, turning, t_s = candidates.poses, candidates.turning, self._t_s
        cost = self._goal_cost(tick, candidates)
        change = turning - candidates.turning_now
        cost += _TURN * turning**2 + _SMOOTHNESS * np.abs(change)
        rectangles = self._footprint.at(poses)
        # Whoever stays farther away than any comfort has no cost.
        near_m = self._footprint.reach_m + max(self.person_comfort_m, self.box_comfort_m)
        scene = tick.scene.near(poses, near_m, self._sampling.horizon_s)
        if scene.people:
            close = _closeness(scene.people_gap_m(rectangles, t_s), self.person_comfort_m)
            weighted = _PERSON * close * self._late_people
            # The worst moment decides; the mean leads a robot inside a disc out of it.
            cost += (weighted.max(axis=1) + weighted.sum(axis=1) / len(t_s)).sum(axis=0)
        if scene.boxes_odom_m:
            close = _closeness(scene.box_gap_m(rectangles), self.box_comfort_m)
            worst_box = (close * self._late_boxes).max(axis=0)
            if abs(tick.state.speed_mps) < _STANDING_MPS:
                # A turn on the spot leads out: the swing of its corners costs nothing.
                now = scene.box_gap_m(self._footprint.at(STANDING))
                worst_box[0] = _closeness(now, self.box_comfort_m)
            cost += _BOX * worst_box
        return cost

    def _goal_cost(self, tick: Tick, candidates: Candidates) -> FloatArray:
        """Return the cost (V, W) of mean distance to the goal and of going away from it."""
        aim = tick.aim
        to_x, to_y = aim.from_poses_m(candidates.poses)
        distance = np.sqrt(to_x * to_x + to_y * to_y)
        full_gain_m = 0.5 * self.robot.max_speed_mps * self._sampling.horizon_s
        farther_m = distance.sum(axis=0) / len(distance) - aim.distance_m
        # At the goal there is no direction to face.
        away = np.minimum(distance[-1] / GOAL_TOLERANCE_M, 1.0)
        weight = _HEADING / math.pi
        if self._reversing is not None and abs(aim.bearing_rad) > _BEHIND_RAD:
            weight *= _TURN_BACK  # its turn leads away from the goal at first
        facing = weight * candidates.off_rad(to_x, to_y) * away
        return np.asarray(farther_m / full_gain_m + facing)

    def _backing_cost(self, tick: Tick, candidates: Candidates) -> FloatArray:
        """Return the cost (V, W) of motions backward: those that turn most to the goal are best."""
        cost = candidates.off_rad(*tick.aim.from_poses_m(candidates.poses))
        near_m = self._footprint.reach_m + self.box_comfort_m
        scene = tick.scene.near(candidates.poses, near_m, 0.0)
        if scene.boxes_odom_m:
            gaps_m = scene.box_gap_m(self._footprint.at(candidates.poses))
            cost = cost + _closeness(gaps_m, self.box_comfort_m).max(axis=0)
        cost[0] += math.tau  # rather slowly than not at all
        return cost


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


def _closeness(gap_m: FloatArray, comfort_m: float) -> FloatArray:
    """Return 0 for gaps from ``comfort_m``, rising quadratically to 1 at contact, and 1 inside."""
    share = np.minimum(np.maximum(1.0 - gap_m / comfort_m, 0.0), 1.0)
    return np.asarray(share * share)
