"""The rules of the speed limit: each is a value that knows no other, and the lowest limit counts.

``docs/safety.md`` lists them from here. A policy leaves rules out by name
(:attr:`~nav_adapter.AwarenessPolicy.without`): with ``in the path`` alone, a robot is one with a
safety laser scanner, which knows neither people nor speeds.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Final, NamedTuple

from ._policy import AwarenessPolicy
from ._robot import RobotProfile
from .course import Course, course_of, starts_of
from .limit import in_the_path_mps, limit_mps, stops_in_time
from .reach import Reach
from .rigid import Motion

#: The limit of a direction that no sensor has seen lately: the reduced speed of ISO 10218-1, at
#: which people can evade a robot. ISO 3691-4 allows trucks 0.3 m/s without detection of people.
CREEPING_MPS: Final = 0.25
#: Directions for which it is known when they were last seen, so many around the base.
SECTORS: Final = 12
#: The stamp from which each of them has been seen, or None; empty if nothing is known of it.
Sectors = tuple[float | None, ...]


class Known(NamedTuple):
    """All that rules ask of one person at one time, as plain floats.

    Attributes:
        key: of the person.
        reach: how far they can come, with the U of their awareness.
        first_sight_mps: U while awareness does not count yet; ``reach.speed_mps`` from then on.
        body_m: body radius and uncertainty of the present place.
        least_mps: what somebody who is lost allows at least; −∞ for everybody else.
    """

    key: int
    reach: Reach
    first_sight_mps: float
    body_m: float
    least_mps: float = -math.inf

    @property
    def at_first_sight(self) -> Reach:
        """The reach of somebody unaware while awareness does not count yet, ``reach`` then."""
        if self.first_sight_mps <= self.reach.speed_mps:
            return self.reach
        return self.reach.at_least(self.first_sight_mps)


class Courses(NamedTuple):
    """The courses of a robot at one time.

    Attributes:
        field: the curve that it drives, with the clearance of the protective field.
        turned: all courses turned by up to ``turn_deg`` off its own; its own, if it keeps to that.
    """

    field: Course
    turned: Course

    @classmethod
    def of(
        cls, policy: AwarenessPolicy, robot: RobotProfile, motion: Motion, age_s: float
    ) -> Courses:
        """Return the courses of a robot whose motion is ``age_s`` old."""
        return cls._around(policy, robot, course_of(robot, motion, 0.0, age_s))

    @classmethod
    def of_starts(
        cls, policy: AwarenessPolicy, robot: RobotProfile, motion: Motion, age_s: float
    ) -> Courses:
        """Return the courses on which a robot that stands may start otherwise than forwards."""
        return cls._around(policy, robot, starts_of(robot, motion, 0.0, age_s))

    @classmethod
    def _around(cls, policy: AwarenessPolicy, robot: RobotProfile, own: Course) -> Courses:
        turned = own.turned(robot.turn_rad(policy.reach.turn_deg))
        return cls(own.grown(policy.margins.clearance_m), turned)

    def braking(self) -> Courses:
        """Return the courses of a robot that brakes at once."""
        return Courses(*(course._replace(reaction_s=0.0) for course in self))


@dataclass(frozen=True, slots=True)
class Rule(ABC):
    """A rule of the limit that one person sets. It knows no other rule."""

    name: ClassVar[str]

    @abstractmethod
    def cap(self, person: Known, courses: Courses, at_most_mps: float = math.inf) -> float:
        """Return the highest speed that the rule allows.

        A limit of ``at_most_mps`` or more may be any other such one, which takes less time.
        """

    @abstractmethod
    def suffices(self, person: Known, courses: Courses, speed_mps: float) -> bool:
        """Return whether a robot keeps the rule that brakes fully from now on."""


class _Reached(Rule):
    """A rule by which a robot stands before a reach arrives, on any course that it may turn to."""

    @abstractmethod
    def reach(self, person: Known) -> Reach | None:
        """Return the reach that the robot may not meet while it moves, if any."""

    def cap(self, person: Known, courses: Courses, at_most_mps: float = math.inf) -> float:
        """Return the highest speed that the rule allows."""
        reach = self.reach(person)
        return math.inf if reach is None else limit_mps(reach, courses.turned, at_most_mps)

    def suffices(self, person: Known, courses: Courses, speed_mps: float) -> bool:
        """Return whether a robot keeps the rule that brakes fully from now on."""
        reach = self.reach(person)
        return reach is None or stops_in_time(reach, courses.turned, speed_mps)


class WithinReach(_Reached):
    """The robot stands before anybody can reach it, on any course that it may turn to.

    People may change to any velocity up to the U of their awareness.
    """

    name = "reach"

    def reach(self, person: Known) -> Reach:
        """Return the reach with the U of their awareness."""
        return person.reach


class WalkingOn(_Reached):
    """The robot stands before somebody who keeps to their motion arrives, on any such course.

    They keep to it until what they know of the robot ends, and are unaware from then on.
    It counts where walking on is not within their reach: for people who walk faster than their U,
    and, with the whole clearance, for everybody else who has noticed the robot and walks.
    """

    name = "walking on"

    def reach(self, person: Known) -> Reach | None:
        """Return the way of the person, and what they may do once they are unaware."""
        return person.reach.walking_on() if person.reach.may_walk_on else None


class FirstSight(_Reached):
    """Awareness raises no speed until frames have shown a person for 0.2 s: they are unaware."""

    name = "first sight"

    def reach(self, person: Known) -> Reach | None:
        """Return the reach of somebody unaware while awareness does not count yet."""
        reach = person.at_first_sight
        return None if reach is person.reach else reach


class Path(Rule):
    """Nobody's body is in the protective field of a safety laser scanner, today's AMR.

    The field is the robot's own curve until it stands, with ``clearance_m`` ahead and on either
    side. The nearer of predicted and tracked position counts: the person may have stopped.
    """

    name = "in the path"

    def cap(self, person: Known, courses: Courses, at_most_mps: float = math.inf) -> float:
        """Return the highest speed that the rule allows."""
        reach, body_m, field = person.reach, person.body_m, courses.field
        x, y, age_s = reach.x_m, reach.y_m, reach.elapsed_s
        lowest = in_the_path_mps((x, y), body_m, field, age_s)
        vx, vy = reach.velocity_x_mps, reach.velocity_y_mps
        if age_s > 0.0 and (vx or vy):
            now_m = x + age_s * vx, y + age_s * vy
            lowest = min(lowest, in_the_path_mps(now_m, body_m, field, age_s))
        return lowest

    def suffices(self, person: Known, courses: Courses, speed_mps: float) -> bool:
        """Return whether a robot keeps the rule that brakes fully from now on."""
        return self.cap(person, courses.braking()) >= speed_mps


@dataclass(frozen=True, slots=True)
class Lost:
    """Somebody who was dropped counts as if still there, but allows a limit that rises slowly.

    It starts at the limit that they set then and rises by ``lost_rise_mps2``. No other rule lowers
    the limit below it, so a robot that has passed them is free.

    Attributes:
        rise_mps2: of the policy; None: everything is allowed at once.
    """

    name: ClassVar[str] = "lost"
    rise_mps2: float | None

    def least_mps(self, first_mps: float, lost_s: float) -> float:
        """Return what somebody allows at least who is lost for so long, and set a limit then."""
        return math.inf if self.rise_mps2 is None else first_mps + self.rise_mps2 * lost_s


@dataclass(frozen=True, slots=True)
class Unseen:
    """The robot creeps (0.25 m/s) in a direction that no sensor has seen for ``stale_after_s``.

    It counts where it is known what the sensors see, for the direction of travel.

    Attributes:
        stale_after_s: of the policy.
    """

    name: ClassVar[str] = "unseen"
    stale_after_s: float

    def cap(self, seen_s: Sectors, bearing_rad: float, now: float) -> float:
        """Return the limit of a direction from the base; ``seen_s`` are stamps of the sectors."""
        if not seen_s:
            return math.inf
        stamp_s = seen_s[round(bearing_rad * SECTORS / (2.0 * math.pi)) % SECTORS]
        fresh = stamp_s is not None and now - stamp_s <= self.stale_after_s
        return math.inf if fresh else CREEPING_MPS


def seen_sectors(seen_stamp_s: Callable[[float, float], float | None] | None) -> Sectors:
    """Return the stamps of all sectors by a function of a bearing and half a width (rad)."""
    if seen_stamp_s is None:
        return ()
    half_rad = math.pi / SECTORS
    return tuple(seen_stamp_s(2.0 * half_rad * index, half_rad) for index in range(SECTORS))


#: All rules. Those of the limit of one person come in the order in which they name a tie.
RULES: Final = (WithinReach, WalkingOn, FirstSight, Path, Lost, Unseen)


def rules_of(policy: AwarenessPolicy) -> tuple[Rule, ...]:
    """Return the rules of a policy for the limit that one person sets."""
    every: tuple[Rule, ...] = (WithinReach(), WalkingOn(), FirstSight(), Path())
    return tuple(rule for rule in every if policy.applies(rule.name))


def lowest(
    person: Known, courses: Courses, rules: tuple[Rule, ...], at_most_mps: float = math.inf
) -> tuple[float, str]:
    """Return the lowest limit of the rules for one person, infinite for none, and its rule.

    A limit of ``at_most_mps`` or more may be any other such one.
    """
    lowest_mps, name = courses.turned.maximum_mps, ""
    for rule in rules:
        own_mps = rule.cap(person, courses, at_most_mps)
        if own_mps < lowest_mps:
            lowest_mps, name = own_mps, rule.name
            at_most_mps = min(at_most_mps, own_mps)
    if person.least_mps > lowest_mps:
        lowest_mps, name = person.least_mps, Lost.name
    return (math.inf if lowest_mps >= courses.turned.maximum_mps else lowest_mps), name
