"""What a person does about a robot that has been seen and comes across the way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from ._person import RobotBody
from ._spec import Reactions

ReactionName = Literal["walk_on", "wait", "hurry", "pass_behind", "claim"]
REACTIONS: Final = get_args(ReactionName)

# Courses conflict when, going on as now, the middles come nearer than this within so long.
_NEAR_M: Final = 1.1
_AHEAD_S: Final = 6.0
_WITHIN_M: Final = 12.0
# Deciding takes a moment; an encounter is over when nothing has conflicted for a while.
_DECIDING_S: Final = 0.3
_OVER_S: Final = 3.0
_FAR_M: Final = 6.0
_MOVING_MPS: Final = 0.08
# A robot this slow seems to wait itself.
_CRAWLING_MPS: Final = 0.25
# Who lets a robot pass keeps this far from the line that its middle follows, and waits for one that
# waits itself no longer than some seconds, nor for any other for ever.
_ASIDE_M: Final = 1.1
_PATIENCE_S: Final = 3.0
_LONGEST_WAIT_S: Final = 15.0
_APPROACH_HZ: Final = 2.5
# Two who walk along the same line meet head on; behind or beside such a robot leads the way aside.
_HEAD_ON_SINE: Final = 0.35
_LEAST_ONWARD: Final = 0.3
_PASSED_M: Final = 0.35
_STOPPING_MPS2: Final = 1.2
_SIDE_STEP_MPS: Final = 0.7
# Faster within human limits: half as fast again, up to a run of 2 m/s.
_HURRY: Final = 1.5
_HURRY_MPS: Final = 2.0
_CLAIM: Final = 1.1
# Whoever passes behind aims at a point so far behind the robot's tail.
_BEHIND_M: Final = 0.75


@dataclass(frozen=True, slots=True)
class Intent:
    """Where a person wants to go now: a unit vector in odom and a speed."""

    x: float
    y: float
    speed_mps: float


class Meeting:
    """Draws one reaction an encounter and carries it out.

    Two are in an encounter from when a person who knows of the robot finds it on a conflicting
    course, by the closest approach of two who go on with constant velocity.

    Args:
        reactions: shares of the reactions.
        rng: draws them.

    Attributes:
        reaction: of the encounter that is on; empty before and after.
        first_reaction: of the first encounter; empty until then.
    """

    def __init__(self, reactions: Reactions, rng: np.random.Generator) -> None:
        self._shares = np.cumsum([getattr(reactions, name) for name in REACTIONS])
        self._rng = rng
        self.reaction = ""
        self.first_reaction = ""
        self._conflict_since_s: float | None = None
        self._conflict_s = -math.inf
        self._began_s = 0.0
        self._stood_s = 0.0
        self._side = 0.0
        self._line = (1.0, 0.0)
        # The reaction has done its part; the robot has been met.
        self._settled = False
        self._passed = False
        self._head_on = False

    @property
    def goes_first(self) -> bool:
        """Whether the person relies on the robot to make way just now."""
        return self.reaction in ("walk_on", "hurry", "claim") and not self._passed

    def react(
        self,
        t_s: float,
        dt_s: float,
        place: tuple[float, float],
        intent: Intent,
        robot: RobotBody | None,
        *,
        standing: bool = False,
    ) -> Intent:
        """What becomes of an intent.

        Args:
            t_s: now.
            dt_s: since the last call.
            place: x, y of the person.
            intent: along the route at the usual speed.
            robot: as far as the person knows; None does not know where it is.
            standing: the person has no way to go: letting the robot pass is stepping aside.
        """
        conflict = robot is not None and _conflicting(place, intent, robot)
        if conflict:
            self._conflict_s = t_s
            if self._conflict_since_s is None:
                self._conflict_since_s = t_s
        elif t_s - self._conflict_s > _DECIDING_S:
            self._conflict_since_s = None
        over = t_s - max(self._conflict_s, self._began_s) > _OVER_S
        if over and (robot is None or self._passed or _distance(place, robot) > _FAR_M):
            self.reaction = ""
        if robot is None:
            return intent
        if not self.reaction:
            if not conflict or self._conflict_since_s is None:
                return intent
            if t_s - self._conflict_since_s < _DECIDING_S - 1e-9:
                return intent
            self._begin(t_s, place, intent, robot)
        return self._carried_out(t_s, dt_s, place, intent, robot, standing)

    def _begin(
        self, t_s: float, place: tuple[float, float], intent: Intent, robot: RobotBody
    ) -> None:
        drawn = int(np.searchsorted(self._shares, self._rng.random() * self._shares[-1], "right"))
        self.reaction = REACTIONS[min(drawn, len(REACTIONS) - 1)]
        self.first_reaction = self.first_reaction or self.reaction
        self._began_s, self._stood_s = t_s, 0.0
        self._settled = self._passed = False
        self._line = _line_of(robot)
        side = _side(place, robot, self._line)
        # Somebody right on the line gets off it the way that is walked anyway, or to the left.
        onward = intent.speed_mps * (self._line[0] * intent.y - self._line[1] * intent.x)
        if abs(side) < 0.1:
            side = onward if abs(onward) > 0.1 else 1.0
        self._side = math.copysign(1.0, side)
        across = self._line[0] * intent.y - self._line[1] * intent.x
        self._head_on = abs(across) < _HEAD_ON_SINE

    def _carried_out(
        self,
        t_s: float,
        dt_s: float,
        place: tuple[float, float],
        intent: Intent,
        robot: RobotBody,
        standing: bool,
    ) -> Intent:
        moves = math.hypot(robot.vx_mps, robot.vy_mps) > _MOVING_MPS
        if moves:
            self._line = _line_of(robot)
        ux, uy = self._line
        dx, dy = place[0] - robot.x_m, place[1] - robot.y_m
        ahead = dx * ux + dy * uy
        side = ux * dy - uy * dx
        crossed = side * self._side < -_ASIDE_M
        slow = math.hypot(robot.vx_mps, robot.vy_mps) < _CRAWLING_MPS
        self._stood_s = max(self._stood_s + (dt_s if slow else -dt_s), 0.0)
        if ahead < -robot.half_length_m - _PASSED_M or crossed:
            self._settled = self._passed = True
        if self.reaction in ("wait", "pass_behind") or standing:
            # No patience is endless.
            late = t_s - self._began_s > _LONGEST_WAIT_S
            self._settled = self._settled or self._stood_s > _PATIENCE_S or late
        if self._settled or self.reaction == "walk_on" or (standing and self.reaction == "claim"):
            return intent
        if standing:
            return self._aside(intent, side, 0.0)
        if self._head_on and self.reaction in ("wait", "pass_behind"):
            return self._aside(intent, side, intent.speed_mps)
        if self.reaction == "wait":
            return self._waiting(intent, side)
        if self.reaction == "pass_behind":
            return _behind(place, intent, robot, self._line)
        haste = _HURRY if self.reaction == "hurry" else _CLAIM
        fastest = max(_HURRY_MPS, intent.speed_mps)
        return Intent(intent.x, intent.y, min(haste * intent.speed_mps, fastest))

    def _waiting(self, intent: Intent, side: float) -> Intent:
        """Stops short of the robot's way, or gets off it."""
        room = side * self._side - _ASIDE_M
        if room < 0.0:
            return self._aside(intent, side, 0.0)
        inwards = (intent.x * self._line[1] - intent.y * self._line[0]) * self._side
        if inwards < 0.05:
            return intent
        most = math.sqrt(2.0 * _STOPPING_MPS2 * room / inwards)
        most = min(most, _APPROACH_HZ * room / inwards)
        return Intent(intent.x, intent.y, min(intent.speed_mps, most))

    def _aside(self, intent: Intent, side: float, onward_mps: float) -> Intent:
        """Off the robot's way, and on beside it with some speed."""
        ux, uy = self._line
        lacks = max(_ASIDE_M - side * self._side, 0.0)
        out = min(_SIDE_STEP_MPS, 2.0 * lacks) * self._side
        onward = math.copysign(onward_mps, intent.x * ux + intent.y * uy)
        onward *= max(1.0 - lacks, _LEAST_ONWARD)
        vx, vy = onward * ux - out * uy, onward * uy + out * ux
        speed = math.hypot(vx, vy)
        if speed < 1e-3:
            return Intent(intent.x, intent.y, 0.0)
        return Intent(vx / speed, vy / speed, speed)


def _line_of(robot: RobotBody) -> tuple[float, float]:
    """Unit vector along which the robot goes."""
    speed = math.hypot(robot.vx_mps, robot.vy_mps)
    if speed > _MOVING_MPS:
        return robot.vx_mps / speed, robot.vy_mps / speed
    return math.cos(robot.heading_rad), math.sin(robot.heading_rad)


def _distance(place: tuple[float, float], robot: RobotBody) -> float:
    return math.hypot(place[0] - robot.x_m, place[1] - robot.y_m)


def _side(place: tuple[float, float], robot: RobotBody, line: tuple[float, float]) -> float:
    """How far left of the robot's line a place is."""
    return line[0] * (place[1] - robot.y_m) - line[1] * (place[0] - robot.x_m)


def _conflicting(place: tuple[float, float], intent: Intent, robot: RobotBody) -> bool:
    """Whether the two come near each other, going on as they mean to."""
    if math.hypot(robot.vx_mps, robot.vy_mps) <= _MOVING_MPS:
        return False
    dx, dy = robot.x_m - place[0], robot.y_m - place[1]
    distance = math.hypot(dx, dy)
    if distance > _WITHIN_M:
        return False
    vx = robot.vx_mps - intent.speed_mps * intent.x
    vy = robot.vy_mps - intent.speed_mps * intent.y
    squared = vx * vx + vy * vy
    if squared < 1e-9:
        return False
    when = -(dx * vx + dy * vy) / squared
    if not 0.0 < when < _AHEAD_S:
        return False
    return math.hypot(dx + when * vx, dy + when * vy) < _NEAR_M


def _behind(
    place: tuple[float, float], intent: Intent, robot: RobotBody, line: tuple[float, float]
) -> Intent:
    """Towards where the robot's tail will be by the time that one gets there."""
    ux, uy = line
    back = robot.half_length_m + _BEHIND_M
    speed = max(intent.speed_mps, 1e-3)
    after = 0.0
    aim = (robot.x_m - back * ux, robot.y_m - back * uy)
    for _ in range(4):
        after = min(math.dist(place, aim) / speed, _AHEAD_S)
        aim = (
            robot.x_m - back * ux + after * robot.vx_mps,
            robot.y_m - back * uy + after * robot.vy_mps,
        )
    dx, dy = aim[0] - place[0], aim[1] - place[1]
    distance = math.hypot(dx, dy)
    if distance < 1e-3:
        return Intent(intent.x, intent.y, 0.0)
    return Intent(dx / distance, dy / distance, intent.speed_mps)
