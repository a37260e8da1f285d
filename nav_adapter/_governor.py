"""The speed limit: the lowest that any person sets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ._known import known_now
from ._people import Person, human_speed_mps
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState
from .course import stands_still, travel_bearing_rad
from .rigid import Motion
from .rules import Courses, Lost, Sectors, Unseen, lowest, rules_of


@dataclass(frozen=True, slots=True)
class GovernedSpeed:
    """A speed limit and its reason, while the adapter works it out.

    Attributes:
        limit_mps: ≥ 0.
        limited_by: person and rule, or the robot's maximum.
        braking_suffices: whether a robot that brakes from now on stops in time.
        fastest_point_mps: the limit without the robot's own maximum, ≥ ``limit_mps``; infinite if
            nobody limits the robot.
        track_id: the person who sets the limit; None if nobody does, or somebody who is lost.
        other_way_mps: the same as ``fastest_point_mps`` for a robot that goes another way than it
            moves.
    """

    limit_mps: float
    limited_by: str
    braking_suffices: bool
    fastest_point_mps: float
    track_id: int | None = None
    other_way_mps: float = math.inf

    def at_most(self, limit_mps: float, limited_by: str) -> GovernedSpeed:
        """Return the lower of this limit and another one, which has a reason of its own."""
        fastest_mps = min(self.fastest_point_mps, limit_mps)
        other_mps = min(self.other_way_mps, limit_mps)
        found = replace(self, fastest_point_mps=fastest_mps, other_way_mps=other_mps)
        if limit_mps < self.limit_mps:
            found = replace(found, limit_mps=limit_mps, limited_by=limited_by, track_id=None)
        return found

    def stopped(self, limited_by: str) -> GovernedSpeed:
        """Return a limit of 0 for this reason."""
        return GovernedSpeed(0.0, limited_by, self.braking_suffices, 0.0, None, 0.0)


class SpeedGovernor:
    """Computes the speed limit: the lowest of all people around the robot, and of all rules."""

    def __init__(self, policy: AwarenessPolicy, robot: RobotProfile) -> None:
        self._policy, self._robot = policy, robot
        self._unaware_mps = human_speed_mps(policy, 0.0)
        self._rules, self._lost = rules_of(policy), Lost(policy.timing.lost_rise_mps2)
        self._unseen = Unseen(policy.timing.stale_after_s)

    def limit(
        self,
        people: Mapping[int, Person],
        lost: Mapping[int, Person],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
        seen_s: Sectors = (),
    ) -> tuple[GovernedSpeed, dict[int, Person]]:
        """Return the limit at ``now`` for a robot whose state is ``robot_age_s`` old.

        Those lost people who still limit it are returned too.
        """
        motion, maximum_mps = Motion.of(robot_state), self._robot.max_speed_mps
        stands = stands_still(motion)
        kept: dict[int, Person] = {}
        lowest_mps, reason, key, suffices = math.inf, "robot maximum", None, True
        # A robot that moves must stand before it goes another way.
        other_mps = math.inf if stands else 0.0
        courses = other = None
        if people or lost:
            courses = self.courses(robot_state, robot_age_s)
            if stands:
                other = Courses.of_starts(self._policy, self._robot, motion, robot_age_s)
        speed_mps = motion.travel_mps
        for each, person in {**people, **lost}.items():
            assert courses is not None
            known = known_now(self._policy, self._unaware_mps, each, person, now)
            # A limit that is not the lowest counts only where it is below the speed.
            at_most_mps = math.inf if person.is_lost else max(lowest_mps, speed_mps)
            own_mps, rule = lowest(known, courses, self._rules, at_most_mps)
            back_mps, least_mps = math.inf, 0.0
            if other is not None:
                at_most_mps = math.inf if person.is_lost else other_mps
                back_mps, _ = lowest(known, other, self._rules, at_most_mps)
            if person.is_lost:
                first_mps = person.lost_limit_mps
                if first_mps is None:  # a robot that stands may leave either way
                    first_mps = min(own_mps, back_mps)
                least_mps = self._lost.least_mps(first_mps, person.lost_for_s(now))
                if least_mps >= maximum_mps:
                    continue
                kept[each] = person._replace(lost_limit_mps=first_mps)
                rule = self._lost.name
            elif own_mps < speed_mps and suffices and not stands:
                # A robot within its limit has the whole reaction time left.
                suffices = all(every.suffices(known, courses, speed_mps) for every in self._rules)
            own_mps = max(own_mps, least_mps)
            if own_mps < lowest_mps:
                lowest_mps, reason = own_mps, f"track {each}: {rule}"
                key = None if person.is_lost else each
            if other is not None:
                other_mps = min(other_mps, max(back_mps, least_mps))
        if lowest_mps >= maximum_mps:
            reason, key = "robot maximum", None
        limit_mps = min(lowest_mps, maximum_mps)
        found = GovernedSpeed(limit_mps, reason, suffices, lowest_mps, key, other_mps)
        return self._seen(found, motion, seen_s, now), kept

    def _seen(
        self, found: GovernedSpeed, motion: Motion, seen_s: Sectors, now: float
    ) -> GovernedSpeed:
        """Return a limit under that of a direction of travel that no sensor has seen lately."""
        if not seen_s or not self._policy.applies(self._unseen.name):
            return found
        ahead_rad = travel_bearing_rad(motion.forward_mps, motion.left_mps)
        back_mps = self._unseen.cap(seen_s, math.pi, now)
        found = replace(found, other_way_mps=min(found.other_way_mps, back_mps))
        cap_mps = self._unseen.cap(seen_s, ahead_rad, now)
        if cap_mps == math.inf:
            return found
        where = f"{math.degrees(ahead_rad):.0f} degrees from ahead"
        return found.at_most(cap_mps, f"{self._unseen.name}: no sensor sees the way, {where}")

    def courses(self, robot_state: RobotState, robot_age_s: float) -> Courses:
        """Return the robot's courses, its own and all that the rules ask for."""
        return Courses.of(self._policy, self._robot, Motion.of(robot_state), robot_age_s)

    def person_mps(self, person: Person, courses: Courses, now: float, at_most_mps: float) -> float:
        """Return the limit that one person sets, infinite for none."""
        known = known_now(self._policy, self._unaware_mps, person.id, person, now)
        return lowest(known, courses, self._rules, at_most_mps)[0]
