"""The speed limit: the highest speed at which the robot stands before anybody can reach it.

The robot keeps its course, turned by up to ``turn_deg`` either way, drives at v for the reaction
time and brakes. The limit is the highest v such that, at v *and at every lower speed*, its
footprint stays out of all reaches while it moves (:mod:`nav_adapter.reach`, ``docs/safety.md``).

For a fixed time t the way of the robot, s = v t − a (t − T)₊²/2, is linear in v, and it moves if
v > a (t − T)₊. A rectangle whose base goes straight is within a distance of a point for an interval
of s, and so is the union over all courses of a fan. So each time gives an interval of speeds, and
the limit is the lowest speed of them all: there is no grid of speeds or headings. Between two
times the reach is that of the later one, about the middle of the way between, larger by half of it,
and the robot may be anywhere between its places at the two. So nothing slips through, and time 0
counts.
"""

from __future__ import annotations

import math
from functools import lru_cache
from heapq import heappop, heappush
from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M

from ._robot import RobotProfile
from .course import ROOM, STANDING_MPS, Course, contact_m, course_of, reach_at
from .policies import ReachRules
from .reach import Reach
from .rigid import Motion

__all__ = [
    "FINEST",
    "PASSING_MPS",
    "STANDING_MPS",
    "STEPS",
    "in_the_path_mps",
    "limit_mps",
    "passing_radius_m",
    "step_of_s",
    "stops_in_time",
]

#: Steps of time while the robot brakes from its maximum.
STEPS: Final = 12
#: Share of such a step that the one that decides is refined to.
FINEST: Final = 0.13
#: The limit beside a circle that a planner keeps to, or the maximum of a slower robot.
PASSING_MPS: Final = 0.3
# So many steps are first looked at as one.
_STEPS_A_LOOK: Final = 6
# A robot that brakes at once has no shorter steps: there would be too many in its reaction time.
_SHORTEST_S: Final = 0.01
# More than the rounding of any distance that matters.
_ROUNDING_M: Final = 1e-9


def step_of_s(maximum_mps: float, deceleration_mps2: float) -> float:
    """Return the step of time of a robot, which depends on neither reaction time nor age."""
    return max(maximum_mps / deceleration_mps2 / STEPS, _SHORTEST_S)


def limit_mps(person: Reach, course: Course, at_most_mps: float = math.inf) -> float:
    """Return the highest speed at which the robot meets the reach of one person at a stand only.

    The same holds for every lower speed. A number that is not finite gives 0. The result lies below
    the exact one by what the last, finest steps of time leave open. It is ``at_most_mps``, which
    takes less time, or the maximum where the limit is not lower.
    """
    maximum = min(course.maximum_mps, at_most_mps)
    if not person.elapsed_s >= 0.0:
        return 0.0
    size_m = _size_m(course)
    if _is_far(person, course, size_m, maximum):
        return maximum
    a, T = course.deceleration_mps2, course.reaction_s + person.elapsed_s
    step_s = _step_s(course)
    finest_s = FINEST * step_s
    # Intervals of time whose reach is met, the one with the lowest speed first.
    meetings: list[tuple[float, float, float]] = []
    t = looked_until_s = 0.0
    limit = maximum
    while True:
        if a * (t - T) < limit:  # a robot at the limit so far still moves at t
            later = t + step_s
            if t >= looked_until_s:
                # Mostly nothing is met in several steps, which one look at all of them shows.
                looked_until_s = _later_s(t, step_s)
                lowest = _lowest_mps(person, course, size_m, maximum, T, t, looked_until_s)
                if not lowest < maximum:
                    t = looked_until_s
                    continue
            lowest = _lowest_mps(person, course, size_m, maximum, T, t, later)
            if lowest < maximum:
                heappush(meetings, (lowest, t, later))
            t = later
        elif not meetings:
            return maximum
        else:
            lowest, first, last = meetings[0]
            if last - first <= finest_s:
                return lowest
            heappop(meetings)
            middle = 0.5 * (first + last)
            for start, end in ((first, middle), (middle, last)):
                lowest = _lowest_mps(person, course, size_m, maximum, T, start, end)
                if lowest < maximum:
                    heappush(meetings, (lowest, start, end))
        limit = meetings[0][0] if meetings else maximum


def _lowest_mps(
    person: Reach, course: Course, size_m: float, maximum: float, T: float, t0: float, t1: float
) -> float:
    """Return the lowest speed at which the robot meets the reach from t0 to t1; ∞ if there is none.

    The reach is that at t1 about the middle of the person's way between, larger by half of it.
    Speeds from ``maximum`` on may count as none.
    """
    a = course.deceleration_mps2
    need0 = a * (t0 - T) if t0 > T else 0.0  # a faster robot still moves at t0
    braked0_m = 0.5 * need0 * (t0 - T)
    braked1_m = 0.5 * a * (t1 - T) * (t1 - T) if t1 > T else 0.0
    x, y, distance2, reach, margin = reach_at(person, course, t0, t1)
    apart_m = math.sqrt(distance2) - reach - margin - size_m - _ROUNDING_M
    if apart_m > 0.0 and apart_m >= _way_m(maximum, a, T, t1):
        return math.inf
    near, past, past_behind = contact_m(course, x, y, distance2, reach, margin)
    if need0 * t0 - braked0_m <= past_behind:
        return need0
    if past == -math.inf:
        return math.inf
    lowest = (near + braked1_m) / t1
    if lowest < a * (t1 - T):  # a robot that slow stands before t1
        lowest = math.sqrt(a * (a * T * T + 2.0 * max(near, 0.0))) - a * T
    # Written so that NaN stops the robot.
    if not lowest > need0:
        lowest = need0
    return math.inf if lowest * t0 - braked0_m > past else lowest


def stops_in_time(person: Reach, course: Course, speed_mps: float) -> bool:
    """Return whether a robot that brakes at once from ``speed_mps`` meets a reach at a stand only.

    No reaction time is left to it, but for the age of the data.
    """
    T, a, step_s = person.elapsed_s, course.deceleration_mps2, _step_s(course)
    t = 0.0
    while a * (t - T) < speed_mps:
        if not _apart(person, course, speed_mps, t, t + step_s):
            return False
        t += step_s
    return True


def _apart(person: Reach, course: Course, speed_mps: float, t0: float, t1: float) -> bool:
    """Return whether a robot that brakes at once is out of reach from t0 to t1.

    As for the limit, an interval in which they may meet is halved down to the finest.
    """
    T, a = person.elapsed_s, course.deceleration_mps2
    way0, way1 = _way_m(speed_mps, a, T, t0), _way_m(speed_mps, a, T, t1)
    near, past, past_behind = contact_m(course, *reach_at(person, course, t0, t1))
    if way0 > past_behind and (way1 < near or way0 > past):
        return True
    if t1 - t0 <= FINEST * _step_s(course) or a * (t0 - T) >= speed_mps:
        return a * (t0 - T) >= speed_mps  # a robot that stands meets nobody
    middle = 0.5 * (t0 + t1)
    return _apart(person, course, speed_mps, t0, middle) and _apart(
        person, course, speed_mps, middle, t1
    )


def _way_m(speed_mps: float, a: float, T: float, t: float) -> float:
    """Return the way until t of a robot that brakes from T on, and then stands."""
    braked_s = min(t - T, speed_mps / a)
    if braked_s <= 0.0:
        return speed_mps * t
    return speed_mps * (T + braked_s) - 0.5 * a * braked_s * braked_s


def in_the_path_mps(
    place_m: tuple[float, float], margin_m: float, field: Course, age_s: float = 0.0
) -> float:
    """Return the highest speed by the protective field of a safety laser scanner.

    The field is the robot's own course until it stands, its footprint larger by a clearance ahead
    and on either side. Scanners know neither people nor speeds, so this is today's AMR. A body of
    radius ``margin_m`` at ``place_m`` (odom), seen ``age_s`` ago, may not be in it. A body behind
    the rear edge is not, and a number that is not finite gives 0.
    """
    dx, dy = place_m[0] - field.x_m, place_m[1] - field.y_m
    x, y = field.cos * dx + field.sin * dy, abs(field.cos * dy - field.sin * dx)
    if x > 0.0 and field.fan_cos * y - field.fan_sin * x > field.half_m + margin_m:
        return field.maximum_mps  # beside it
    near, past, past_behind = contact_m(field, x, y, dx * dx + dy * dy, margin_m, 0.0)
    if past_behind >= 0.0:
        return 0.0
    if past == -math.inf:
        return field.maximum_mps
    if not near > 0.0:
        return 0.0
    a, T = field.deceleration_mps2, field.reaction_s + age_s
    # The root of v T + v²/2a = near.
    return min(2.0 * near / (T + math.sqrt(T * T + 2.0 * near / a)), field.maximum_mps)


@lru_cache(maxsize=64)
def passing_radius_m(
    speed_mps: float,
    rules: ReachRules | None,
    clearance_m: float,
    robot: RobotProfile,
    within_m: float = 0.0,
) -> float:
    """Return the smallest radius of a circle beside which the limit is at least ``PASSING_MPS``.

    For a slower robot, it is its maximum. The robot passes straight along the circle's edge, with
    the person standing anywhere beside it. A planner that reads circles and knows no limit would
    otherwise be led to where the robot hardly moves. It is at least the body radius and the
    clearance.

    Args:
        speed_mps: U.
        rules: of the policy; None for the protective field alone.
        clearance_m: of the policy.
        robot: footprint, braking and reaction time.
        within_m: as in :class:`~nav_adapter.reach.Reach`.
    """
    floor_m = BODY_RADIUS_M + clearance_m
    if rules is None:
        return floor_m
    passing_mps = min(PASSING_MPS, robot.max_speed_mps)
    course = course_of(robot, Motion(0.0, 0.0, 0.0, passing_mps), robot.turn_rad(rules.turn_deg))
    motion = 0.0, 0.0, speed_mps, rules.time_constant_s, rules.delay_s

    def passes(radius_m: float) -> bool:
        beside_m = radius_m + course.half_m
        places = np.linspace(course.rear_m - radius_m, course.front_m + 3.0 * radius_m, 16)
        return all(
            limit_mps(Reach(x_m, beside_m, *motion, 0.0, floor_m, within_m), course) >= passing_mps
            for x_m in places.tolist()
        )

    low_m, high_m = floor_m, floor_m + 0.25
    while not passes(high_m):
        low_m, high_m = high_m, 2.0 * high_m
    while high_m - low_m > 0.004 * high_m:
        middle_m = 0.5 * (low_m + high_m)
        low_m, high_m = (low_m, middle_m) if passes(middle_m) else (middle_m, high_m)
    return high_m


def _is_far(person: Reach, course: Course, size_m: float, maximum_mps: float) -> bool:
    """Return whether a person cannot be met before a robot at that speed has stopped."""
    stop_s = course.reaction_s + person.elapsed_s + maximum_mps / course.deceleration_mps2
    stop_s += _step_s(course)
    around_m = person.farthest_m(stop_s) + person.margin_m + size_m
    distance_m = math.hypot(person.x_m - course.x_m, person.y_m - course.y_m)
    return distance_m > maximum_mps * stop_s + around_m


def _size_m(course: Course) -> float:
    """Return the distance from the base of the farthest part of the robot, on any course."""
    length_m = max(course.front_m, -course.rear_m)
    return math.hypot(length_m, course.half_m) + course.circle_m


def _step_s(course: Course) -> float:
    return step_of_s(course.maximum_mps / ROOM, course.deceleration_mps2)


def _later_s(t: float, step_s: float) -> float:
    """Return the end of the steps from t that are looked at as one, summed up as they are."""
    for _ in range(_STEPS_A_LOOK):
        t += step_s
    return t
