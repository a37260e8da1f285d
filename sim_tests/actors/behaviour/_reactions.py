"""Reactions of a person to a robot: to one on a conflicting course, and to a startling request."""

from __future__ import annotations

import math
from typing import Final, Literal, get_args

import numpy as np

from ._forces import RELAXATION_S
from ._hearing import StartleKind
from ._route import DesiredVelocity
from ._spec import Reactions
from ._surroundings import RobotBody

ReactionName = Literal["walk_on", "wait", "hurry", "pass_behind", "claim"]
REACTIONS: Final = get_args(ReactionName)

# Courses conflict if the predicted closest approach is nearer than this, sooner than this, and the
# robot is within this range.
_CONFLICT_DISTANCE_M: Final = 1.1
_CONFLICT_HORIZON_S: Final = 6.0
_CONFLICT_RANGE_M: Final = 12.0
# A conflict that lasts this long starts an encounter, and a shorter gap does not interrupt it.
_REACTION_TIME_S: Final = 0.3
# An encounter ends after this time without a conflict, once the robot has passed or is this far.
_NO_CONFLICT_S: Final = 3.0
_FAR_M: Final = 6.0
# A slower robot counts as standing, and up to the second speed as one that waits itself.
_ROBOT_STANDING_MPS: Final = 0.08
_ROBOT_WAITING_MPS: Final = 0.25
# A person who lets the robot pass stays this far from its line, the course of its centre. The wait
# for a robot that waits itself ends after the first time, any other wait after the second.
_ASIDE_M: Final = 1.1
_PATIENCE_S: Final = 3.0
_MAX_WAIT_S: Final = 15.0
_APPROACH_HZ: Final = 2.5
_STOPPING_MPS2: Final = 1.2
_SIDE_STEP_MPS: Final = 0.7
_MIN_ONWARD_SHARE: Final = 0.3
# An encounter is head on if the sine of the angle between course and line is smaller.
_HEAD_ON_SINE: Final = 0.35
# The robot has passed once the person is this far behind its tail.
_PASSED_M: Final = 0.35
# Speed of a person who goes first, relative to the free speed, and its upper limit.
_HURRY_FACTOR: Final = 1.5
_CLAIM_FACTOR: Final = 1.1
_MAX_HURRY_MPS: Final = 2.0
# A person who passes behind aims this far behind the robot's tail.
_BEHIND_M: Final = 0.75
# A startle lasts this long. With the usual relaxation, a step into the path covers 0.7 m in it.
_STARTLE_S: Final = 1.0
_ASIDE_MPS: Final = 0.7
_INTO_PATH_MPS: Final = 1.3


class ReactionModel:
    """Draws one reaction per encounter with the robot, and carries it out.

    An encounter starts when a person who knows of the robot is on a conflicting course: the closest
    approach at constant velocities is too near.

    Args:
        reactions: shares of the reactions.
        rng: draws them.

    Attributes:
        reaction: reaction of the present encounter; empty without one.
        first_reaction: reaction of the first encounter; empty before it.
    """

    def __init__(self, reactions: Reactions, rng: np.random.Generator) -> None:
        self._shares = np.cumsum([getattr(reactions, name) for name in REACTIONS])
        self._rng = rng
        self.reaction = ""
        self.first_reaction = ""
        self._conflict_since_s: float | None = None
        self._last_conflict_s = -math.inf
        self._began_s = 0.0
        self._robot_waited_s = 0.0
        self._line = (1.0, 0.0)  # unit vector of the robot's course
        self._side = 0.0  # of the robot's line on which the person is: +1 left, −1 right
        self._head_on = False
        self._completed = False  # the reaction is no longer carried out
        self._passed = False  # the robot has passed, or the person has crossed its line

    @property
    def expects_robot_to_yield(self) -> bool:
        """True while the person goes first in an encounter."""
        return self.reaction in ("walk_on", "hurry", "claim") and not self._passed

    def go_first(self) -> None:
        """Change the mind of a person who lets the robot pass: go first after all."""
        if self.reaction in ("wait", "pass_behind"):
            self.reaction = "claim"

    def react(
        self,
        t_s: float,
        dt_s: float,
        place: tuple[float, float],
        desired: DesiredVelocity,
        robot: RobotBody | None,
        *,
        standing: bool = False,
    ) -> DesiredVelocity:
        """Return the desired velocity as the reaction changes it.

        Args:
            t_s: now.
            dt_s: time since the last call.
            place: x, y of the person.
            desired: velocity along the route.
            robot: the robot as the person knows it; None without knowledge.
            standing: the person is not on the way, and steps aside to let the robot pass.
        """
        conflict = robot is not None and _on_conflicting_course(place, desired, robot)
        if conflict:
            self._last_conflict_s = t_s
            if self._conflict_since_s is None:
                self._conflict_since_s = t_s
        elif t_s - self._last_conflict_s > _REACTION_TIME_S:
            self._conflict_since_s = None
        over = t_s - max(self._last_conflict_s, self._began_s) > _NO_CONFLICT_S
        if over and (robot is None or self._passed or _distance_m(place, robot) > _FAR_M):
            self.reaction = ""
        if robot is None:
            return desired
        if not self.reaction:
            if not conflict or self._conflict_since_s is None:
                return desired
            if t_s - self._conflict_since_s < _REACTION_TIME_S - 1e-9:
                return desired
            self._begin(t_s, place, desired, robot)
        return self._carry_out(t_s, dt_s, place, desired, robot, standing)

    def _begin(
        self, t_s: float, place: tuple[float, float], desired: DesiredVelocity, robot: RobotBody
    ) -> None:
        """Start an encounter and draw its reaction."""
        drawn = int(np.searchsorted(self._shares, self._rng.random() * self._shares[-1], "right"))
        self.reaction = REACTIONS[min(drawn, len(REACTIONS) - 1)]
        self.first_reaction = self.first_reaction or self.reaction
        self._began_s, self._robot_waited_s = t_s, 0.0
        self._completed = self._passed = False
        self._line = _robot_line(robot)
        side = _left_of_line_m(place, robot, self._line)
        # A person on the line leaves it to the side of the route, or to the left.
        onward = desired.speed_mps * (self._line[0] * desired.uy - self._line[1] * desired.ux)
        if abs(side) < 0.1:
            side = onward if abs(onward) > 0.1 else 1.0
        self._side = math.copysign(1.0, side)
        across = self._line[0] * desired.uy - self._line[1] * desired.ux
        self._head_on = abs(across) < _HEAD_ON_SINE

    def _carry_out(
        self,
        t_s: float,
        dt_s: float,
        place: tuple[float, float],
        desired: DesiredVelocity,
        robot: RobotBody,
        standing: bool,
    ) -> DesiredVelocity:
        """Return the desired velocity of the present reaction; update the encounter's state."""
        moves = math.hypot(robot.vx_mps, robot.vy_mps) > _ROBOT_STANDING_MPS
        if moves:
            self._line = _robot_line(robot)
        ux, uy = self._line
        dx, dy = place[0] - robot.x_m, place[1] - robot.y_m
        ahead = dx * ux + dy * uy
        side = ux * dy - uy * dx
        crossed = side * self._side < -_ASIDE_M
        slow = math.hypot(robot.vx_mps, robot.vy_mps) < _ROBOT_WAITING_MPS
        self._robot_waited_s = max(self._robot_waited_s + (dt_s if slow else -dt_s), 0.0)
        if ahead < -robot.half_length_m - _PASSED_M or crossed:
            self._completed = self._passed = True
        if self.reaction in ("wait", "pass_behind") or standing:
            late = t_s - self._began_s > _MAX_WAIT_S
            self._completed = self._completed or self._robot_waited_s > _PATIENCE_S or late
        if self._completed or self.reaction == "walk_on" or (standing and self.reaction == "claim"):
            return desired
        if standing:
            return self._step_aside(desired, side, 0.0)
        if self._head_on and self.reaction in ("wait", "pass_behind"):
            return self._step_aside(desired, side, desired.speed_mps)
        if self.reaction == "wait":
            return self._wait(desired, side)
        if self.reaction == "pass_behind":
            return _pass_behind(place, desired, robot, self._line)
        factor = _HURRY_FACTOR if self.reaction == "hurry" else _CLAIM_FACTOR
        fastest = max(_MAX_HURRY_MPS, desired.speed_mps)
        return DesiredVelocity(desired.ux, desired.uy, min(factor * desired.speed_mps, fastest))

    def _wait(self, desired: DesiredVelocity, side: float) -> DesiredVelocity:
        """Stop short of the robot's line, or step aside if already too near to it."""
        spare_m = side * self._side - _ASIDE_M
        if spare_m < 0.0:
            return self._step_aside(desired, side, 0.0)
        inwards = (desired.ux * self._line[1] - desired.uy * self._line[0]) * self._side
        if inwards < 0.05:
            return desired
        limit = math.sqrt(2.0 * _STOPPING_MPS2 * spare_m / inwards)
        limit = min(limit, _APPROACH_HZ * spare_m / inwards)
        return DesiredVelocity(desired.ux, desired.uy, min(desired.speed_mps, limit))

    def _step_aside(
        self, desired: DesiredVelocity, side: float, onward_mps: float
    ) -> DesiredVelocity:
        """Step away from the robot's line while walking on along it at ``onward_mps``."""
        ux, uy = self._line
        lacking_m = max(_ASIDE_M - side * self._side, 0.0)
        out = min(_SIDE_STEP_MPS, 2.0 * lacking_m) * self._side
        onward = math.copysign(onward_mps, desired.ux * ux + desired.uy * uy)
        onward *= max(1.0 - lacking_m, _MIN_ONWARD_SHARE)
        vx, vy = onward * ux - out * uy, onward * uy + out * ux
        speed = math.hypot(vx, vy)
        if speed < 1e-3:
            return DesiredVelocity(desired.ux, desired.uy, 0.0)
        return DesiredVelocity(vx / speed, vy / speed, speed)


class Startle:
    """A startle: the person stops, steps aside, or steps into the robot's path for a second.

    Args:
        kind: what the person does.
        from_s: time of its start.
    """

    def __init__(self, kind: StartleKind, from_s: float) -> None:
        self._kind, self._from_s = kind, from_s
        self._velocity: DesiredVelocity | None = None

    def is_on(self, t_s: float) -> bool:
        """Return whether the startle has begun and not ended."""
        return self._from_s <= t_s < self._from_s + _STARTLE_S - 1e-9

    def velocity(
        self, t_s: float, place: tuple[float, float], robot: RobotBody
    ) -> DesiredVelocity | None:
        """Return the desired velocity; None before the start and after the end.

        The step leads straight away from the line of the robot's course, or towards it and not past
        it. Its direction stays that of the start.

        Args:
            t_s: now.
            place: x, y of the person.
            robot: the robot now.
        """
        if not self.is_on(t_s):
            return None
        if self._velocity is None:
            ux, uy = line = _robot_line(robot)
            side_m = _left_of_line_m(place, robot, line)
            out = math.copysign(1.0, side_m)
            speed_mps = {"stop": 0.0, "aside": _ASIDE_MPS, "into_path": _INTO_PATH_MPS}[self._kind]
            if self._kind == "into_path":
                speed_mps, out = min(speed_mps, abs(side_m) / RELAXATION_S), -out
            self._velocity = DesiredVelocity(-out * uy, out * ux, speed_mps)
        return self._velocity


def _robot_line(robot: RobotBody) -> tuple[float, float]:
    """Return the unit vector of the robot's course, of its heading if it stands."""
    speed = math.hypot(robot.vx_mps, robot.vy_mps)
    if speed > _ROBOT_STANDING_MPS:
        return robot.vx_mps / speed, robot.vy_mps / speed
    return math.cos(robot.heading_rad), math.sin(robot.heading_rad)


def _distance_m(place: tuple[float, float], robot: RobotBody) -> float:
    return math.hypot(place[0] - robot.x_m, place[1] - robot.y_m)


def _left_of_line_m(
    place: tuple[float, float], robot: RobotBody, line: tuple[float, float]
) -> float:
    """Return the distance of a place to the left of the robot's line."""
    return line[0] * (place[1] - robot.y_m) - line[1] * (place[0] - robot.x_m)


def _on_conflicting_course(
    place: tuple[float, float], desired: DesiredVelocity, robot: RobotBody
) -> bool:
    """Return whether person and robot get too near to each other at their present velocities."""
    if math.hypot(robot.vx_mps, robot.vy_mps) <= _ROBOT_STANDING_MPS:
        return False
    dx, dy = robot.x_m - place[0], robot.y_m - place[1]
    distance = math.hypot(dx, dy)
    if distance > _CONFLICT_RANGE_M:
        return False
    vx = robot.vx_mps - desired.speed_mps * desired.ux
    vy = robot.vy_mps - desired.speed_mps * desired.uy
    squared = vx * vx + vy * vy
    if squared < 1e-9:
        return False
    closest_s = -(dx * vx + dy * vy) / squared
    if not 0.0 < closest_s < _CONFLICT_HORIZON_S:
        return False
    return math.hypot(dx + closest_s * vx, dy + closest_s * vy) < _CONFLICT_DISTANCE_M


def _pass_behind(
    place: tuple[float, float],
    desired: DesiredVelocity,
    robot: RobotBody,
    line: tuple[float, float],
) -> DesiredVelocity:
    """Return the velocity to the point behind the robot's tail at the time of arrival there."""
    ux, uy = line
    back = robot.half_length_m + _BEHIND_M
    speed = max(desired.speed_mps, 1e-3)
    aim = (robot.x_m - back * ux, robot.y_m - back * uy)
    for _ in range(4):
        arrival_s = min(math.dist(place, aim) / speed, _CONFLICT_HORIZON_S)
        aim = (
            robot.x_m - back * ux + arrival_s * robot.vx_mps,
            robot.y_m - back * uy + arrival_s * robot.vy_mps,
        )
    dx, dy = aim[0] - place[0], aim[1] - place[1]
    distance = math.hypot(dx, dy)
    if distance < 1e-3:
        return DesiredVelocity(desired.ux, desired.uy, 0.0)
    return DesiredVelocity(dx / distance, dy / distance, desired.speed_mps)
