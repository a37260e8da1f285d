"""Reactions of a person to a robot: to one on a conflicting course, and to a startling request."""

from __future__ import annotations

import math
from typing import Final, Literal, NamedTuple, get_args

import numpy as np

from nav_adapter.rigid import Motion

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
# A slower robot waits itself.
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
# Another line begins where the robot has turned by more than 20°. Nearer than this to it, somebody
# keeps to the side that they chose, which no robot's outline leaves room to regret.
_SAME_LINE_COSINE: Final = math.cos(math.radians(20.0))
_ON_LINE_M: Final = 0.1
# An arc is foreseen in straight pieces that turn by no more than this.
_STRAIGHT_RAD: Final = 0.25
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
        self._course_rad: float | None = None  # of the robot, that the encounter is about
        self._side = 0.0  # of somebody on the robot's line to step to: +1 left, −1 right
        self._last_place: tuple[float, float] | None = None
        self._over = False  # the person has walked over the robot's line
        self._head_on = False
        self._gave_up = False  # the person waits no longer
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
        last_place, self._last_place = self._last_place, place
        if robot is None:
            return desired
        if not self.reaction:
            if not conflict or self._conflict_since_s is None:
                return desired
            if t_s - self._conflict_since_s < _REACTION_TIME_S - 1e-9:
                return desired
            drawn = np.searchsorted(self._shares, self._rng.random() * self._shares[-1], "right")
            self.reaction = REACTIONS[min(int(drawn), len(REACTIONS) - 1)]
            self.first_reaction = self.first_reaction or self.reaction
            self._began_s, self._robot_waited_s = t_s, 0.0
            self._gave_up, self._course_rad = False, None
        line = self._line_beside(place, last_place, desired, robot)
        if not conflict and not standing and _leaves(place, desired, robot):
            return desired
        return self._carry_out(t_s, dt_s, place, desired, robot, line, standing)

    def _line_beside(
        self,
        place: tuple[float, float],
        last_place: tuple[float, float] | None,
        desired: DesiredVelocity,
        robot: RobotBody,
    ) -> _Line:
        """Return the robot's line as it passes the person; update what is known about both.

        What was said about a line, such as that the robot has passed, holds for that line alone.
        """
        course = self._course_of(robot)
        line = _Line.beside(course, place)
        off_rad = course.heading_rad - (self._course_rad or 0.0)
        if self._course_rad is None or math.cos(off_rad) < _SAME_LINE_COSINE:
            across = line.across(desired)
            # Nobody who has stopped walks on towards a robot because it turns towards them.
            may_be = self._course_rad is None or self._head_on
            self._head_on = may_be and abs(across) < _HEAD_ON_SINE
            self._course_rad = course.heading_rad
            self._over = False
            onward = desired.speed_mps * across
            self._side = math.copysign(1.0, onward if abs(onward) > 0.1 else line.left_m)
        elif last_place is not None and line.left_m * _Line.beside(course, last_place).left_m < 0.0:
            self._over = not self._over
        if abs(line.left_m) > _ON_LINE_M:
            self._side = math.copysign(1.0, line.left_m)
        behind = line.ahead_m < -robot.half_length_m - _PASSED_M
        self._passed = behind or (self._over and abs(line.left_m) > _ASIDE_M)
        return line

    def _course_of(self, robot: RobotBody) -> Motion:
        """Return the robot's course; one that stands waits on the line that it came along."""
        course = robot.course
        if self._course_rad is None or course.forward_mps > 0.0:
            return course
        return course._replace(heading_rad=self._course_rad)

    def _carry_out(
        self,
        t_s: float,
        dt_s: float,
        place: tuple[float, float],
        desired: DesiredVelocity,
        robot: RobotBody,
        line: _Line,
        standing: bool,
    ) -> DesiredVelocity:
        """Return the desired velocity of the present reaction; update the encounter's state."""
        slow = math.hypot(robot.vx_mps, robot.vy_mps) < _ROBOT_WAITING_MPS
        self._robot_waited_s = max(self._robot_waited_s + (dt_s if slow else -dt_s), 0.0)
        yields = self.reaction in ("wait", "pass_behind")
        if yields or standing:
            late = t_s - self._began_s > _MAX_WAIT_S
            self._gave_up = self._gave_up or self._robot_waited_s > _PATIENCE_S or late
        stays_so = self.reaction == "walk_on" or (standing and self.reaction == "claim")
        if self._passed or self._gave_up or stays_so:
            return desired
        if standing:
            return self._step_aside(desired, line, 0.0)
        if self._head_on and yields:
            return self._step_aside(desired, line, desired.speed_mps)
        if self.reaction == "wait":
            return self._wait(desired, line)
        if self.reaction == "pass_behind":
            back_m = robot.half_length_m + _BEHIND_M
            return _pass_behind(place, desired, self._course_of(robot), back_m)
        factor = _HURRY_FACTOR if self.reaction == "hurry" else _CLAIM_FACTOR
        fastest = max(_MAX_HURRY_MPS, desired.speed_mps)
        return DesiredVelocity(desired.ux, desired.uy, min(factor * desired.speed_mps, fastest))

    def _wait(self, desired: DesiredVelocity, line: _Line) -> DesiredVelocity:
        """Stop short of the robot's line, or step aside if already too near to it."""
        spare_m = line.left_m * self._side - _ASIDE_M
        if spare_m < 0.0:
            return self._step_aside(desired, line, 0.0)
        inwards = -line.across(desired) * self._side
        if inwards < 0.05:
            return desired
        limit = math.sqrt(2.0 * _STOPPING_MPS2 * spare_m / inwards)
        limit = min(limit, _APPROACH_HZ * spare_m / inwards)
        return DesiredVelocity(desired.ux, desired.uy, min(desired.speed_mps, limit))

    def _step_aside(
        self, desired: DesiredVelocity, line: _Line, onward_mps: float
    ) -> DesiredVelocity:
        """Step away from the robot's line while walking on along it at ``onward_mps``."""
        ux, uy = line.ux, line.uy
        lacking_m = max(_ASIDE_M - line.left_m * self._side, 0.0)
        out = min(_SIDE_STEP_MPS, 2.0 * lacking_m) * self._side
        onward = math.copysign(onward_mps, desired.ux * ux + desired.uy * uy)
        onward *= max(1.0 - lacking_m, _MIN_ONWARD_SHARE)
        vx, vy = onward * ux - out * uy, onward * uy + out * ux
        speed = math.hypot(vx, vy)
        if speed < 1e-3:
            return DesiredVelocity(desired.ux, desired.uy, 0.0)
        return DesiredVelocity(vx / speed, vy / speed, speed)


class Startle:
    """A startle: the person stops, steps aside, or steps into the robot's path for a second."""

    def __init__(self, kind: StartleKind, from_s: float) -> None:
        self._kind, self._from_s = kind, from_s
        self._velocity: DesiredVelocity | None = None

    def is_on(self, t_s: float) -> bool:
        """Return whether the startle has begun and not ended."""
        return self._from_s <= t_s and not self.is_over(t_s)

    def is_over(self, t_s: float) -> bool:
        """Return whether the startle has ended; until then, no other one begins."""
        return t_s >= self._from_s + _STARTLE_S - 1e-9

    def velocity(
        self, t_s: float, place: tuple[float, float], robot: RobotBody
    ) -> DesiredVelocity | None:
        """Return the desired velocity; None before the start and after the end.

        The step leads straight away from the line of the robot's course, or towards it and not past
        it. Its direction stays that of the start.
        """
        if not self.is_on(t_s):
            return None
        if self._velocity is None:
            line = _Line.beside(robot.course, place)
            ux, uy, side_m = line.ux, line.uy, line.left_m
            out = math.copysign(1.0, side_m)
            speed_mps = {"stop": 0.0, "aside": _ASIDE_MPS, "into_path": _INTO_PATH_MPS}[self._kind]
            if self._kind == "into_path":
                speed_mps, out = min(speed_mps, abs(side_m) / RELAXATION_S), -out
            self._velocity = DesiredVelocity(-out * uy, out * ux, speed_mps)
        return self._velocity


class _Line(NamedTuple):
    """The robot's course where it passes a place: the straight line or the arc of its centre.

    Attributes:
        ahead_m: length of the course from the robot to there; negative behind the robot.
        left_m: distance of the place to the left of the course.
        ux: unit vector of the course there.
        uy: the same.
    """

    ahead_m: float
    left_m: float
    ux: float
    uy: float

    @classmethod
    def beside(cls, course: Motion, place: tuple[float, float]) -> _Line:
        """Return the course beside a place."""
        ux, uy = math.cos(course.heading_rad), math.sin(course.heading_rad)
        dx, dy = place[0] - course.x_m, place[1] - course.y_m
        ahead, left = dx * ux + dy * uy, ux * dy - uy * dx
        if course.yaw_rate_radps == 0.0:
            return cls(ahead, left, ux, uy)
        curve = course.yaw_rate_radps / course.forward_mps  # 1/m, left positive
        # Distance of the place from the centre of the arc, relative to its radius.
        from_centre = math.hypot(curve * ahead, 1.0 - curve * left)
        turned_rad = math.atan2(curve * ahead, 1.0 - curve * left)
        cos, sin = math.cos(turned_rad), math.sin(turned_rad)
        # A robot that goes on in a circle comes to what is behind it as well.
        ahead_rad = math.copysign(1.0, curve) * turned_rad
        comes_within_rad = abs(course.yaw_rate_radps) * _CONFLICT_HORIZON_S
        if ahead_rad < 0.0 and ahead_rad + math.tau < comes_within_rad:
            ahead_rad += math.tau
        return cls(
            ahead_rad / abs(curve),
            (2.0 * left - curve * (ahead * ahead + left * left)) / (1.0 + from_centre),
            ux * cos - uy * sin,
            uy * cos + ux * sin,
        )

    def across(self, desired: DesiredVelocity) -> float:
        """Return the sine of the angle from the course to a desired velocity, left positive."""
        return self.ux * desired.uy - self.uy * desired.ux


def _distance_m(place: tuple[float, float], robot: RobotBody) -> float:
    return math.hypot(place[0] - robot.x_m, place[1] - robot.y_m)


def _leaves(place: tuple[float, float], desired: DesiredVelocity, robot: RobotBody) -> bool:
    """Return whether the way of somebody leads away from the robot faster than it follows."""
    vx = desired.speed_mps * desired.ux - robot.vx_mps
    vy = desired.speed_mps * desired.uy - robot.vy_mps
    return vx * (place[0] - robot.x_m) + vy * (place[1] - robot.y_m) > 0.0


def _on_conflicting_course(
    place: tuple[float, float], desired: DesiredVelocity, robot: RobotBody
) -> bool:
    """Return whether somebody who walks straight on and the robot get too near to each other."""
    course = robot.course
    if course.forward_mps == 0.0 or _distance_m(place, robot) > _CONFLICT_RANGE_M:
        return False
    turns_rad = abs(course.yaw_rate_radps) * _CONFLICT_HORIZON_S
    pieces = math.ceil(turns_rad / _STRAIGHT_RAD) or 1
    piece_s = _CONFLICT_HORIZON_S / pieces
    vx, vy = desired.speed_mps * desired.ux, desired.speed_mps * desired.uy
    least_m, when = math.inf, 0.0
    dx, dy = course.x_m - place[0], course.y_m - place[1]
    for piece in range(pieces):
        end_s = (piece + 1) * piece_s
        end = course.at(end_s)
        ex, ey = end.x_m - place[0] - end_s * vx, end.y_m - place[1] - end_s * vy
        wx, wy = ex - dx, ey - dy
        squared = wx * wx + wy * wy
        share = min(max(-(dx * wx + dy * wy) / squared, 0.0), 1.0) if squared > 1e-12 else 0.0
        distance_m = math.hypot(dx + share * wx, dy + share * wy)
        if distance_m < least_m:
            least_m, when = distance_m, piece + share
        dx, dy = ex, ey
    return 0.0 < when < pieces and least_m < _CONFLICT_DISTANCE_M


def _pass_behind(
    place: tuple[float, float], desired: DesiredVelocity, course: Motion, back_m: float
) -> DesiredVelocity:
    """Return the velocity to the point behind the robot's tail at the time of arrival there."""
    speed = max(desired.speed_mps, 1e-3)
    aim = course.point(-back_m, 0.0)
    for _ in range(4):
        arrival_s = min(math.dist(place, aim) / speed, _CONFLICT_HORIZON_S)
        aim = course.at(arrival_s).point(-back_m, 0.0)
    dx, dy = aim[0] - place[0], aim[1] - place[1]
    distance = math.hypot(dx, dy)
    if distance < 1e-3:
        return DesiredVelocity(desired.ux, desired.uy, 0.0)
    return DesiredVelocity(dx / distance, dy / distance, desired.speed_mps)
