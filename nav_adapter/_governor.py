"""The speed limit: the lowest that any person sets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from perception.anthropometry import BODY_RADIUS_M

from ._people import People, Person
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState
from .limit import (
    STANDING_MPS,
    Course,
    courses_of,
    in_the_path_mps,
    limit_mps,
    stops_in_time,
    straight_course_of,
)


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
    """

    limit_mps: float
    limited_by: str
    braking_suffices: bool
    fastest_point_mps: float
    track_id: int | None = None

    def at_most(self, limit_mps: float, limited_by: str) -> GovernedSpeed:
        """Return the lower of this limit and another one, which has a reason of its own."""
        if limit_mps < self.limit_mps:
            return GovernedSpeed(limit_mps, limited_by, self.braking_suffices, limit_mps)
        return replace(self, fastest_point_mps=min(self.fastest_point_mps, limit_mps))

    def stopped(self, limited_by: str) -> GovernedSpeed:
        """Return a limit of 0 for this reason."""
        return GovernedSpeed(0.0, limited_by, self.braking_suffices, 0.0)


class SpeedGovernor:
    """Computes the speed limit for the people around the robot.

    Each person sets the lower of two limits: that of their reach (:func:`~nav_adapter.limit.
    limit_mps`), and that of a protective field in the robot's straight path, where they are or
    where their track was, which today's robots have too.

    Args:
        policy: reach, margins and time behaviour.
        robot: footprint, braking and reaction time.
        people: gives the reach of each person.
    """

    def __init__(self, policy: AwarenessPolicy, robot: RobotProfile, people: People) -> None:
        self._robot, self._people = robot, people
        self._clearance_m = policy.margins.clearance_m
        self._rise_mps2 = policy.timing.lost_rise_mps2
        self._turn_rad = None if policy.reach is None else math.radians(policy.reach.turn_deg)

    def limit(
        self,
        people: Mapping[int, Person],
        lost: Mapping[int, Person],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> tuple[GovernedSpeed, dict[int, Person]]:
        """Return the limit at ``now`` for a robot whose state is ``robot_age_s`` old.

        The limit that a lost person sets rises by ``lost_rise_mps2``. It is never lower than if
        they were still held, so a robot that has passed them is free. Those who still limit it are
        returned too.
        """
        maximum_mps = self._robot.max_speed_mps
        lowest_mps, reason, suffices = math.inf, "robot maximum", True
        lowest_id: int | None = None
        kept: dict[int, Person] = {}
        if people or lost:
            straight, courses = self.courses(robot_state, robot_age_s)
            speed_mps = robot_state.travel_mps
            for track_id, person in people.items():
                # A limit that is not the lowest counts only where it is below the speed.
                counts_mps = max(lowest_mps, speed_mps)
                own_mps, rule = self.person_mps(person, straight, courses, now, counts_mps)
                if own_mps < lowest_mps:
                    lowest_mps, reason = own_mps, f"track {track_id}: {rule}"
                    lowest_id = track_id
                # A robot within its limit has the whole reaction time left.
                if own_mps < speed_mps and suffices and speed_mps >= STANDING_MPS:
                    suffices = self._stops_in_time(person, straight, courses, speed_mps, now)
            for track_id, person in lost.items():
                own_mps, _ = self.person_mps(person, straight, courses, now)
                first_mps = own_mps if person.lost_limit_mps is None else person.lost_limit_mps
                ceiling_mps = first_mps + (self._rise_mps2 or 0.0) * person.lost_for_s(now)
                if ceiling_mps >= maximum_mps:
                    continue
                kept[track_id] = person._replace(lost_limit_mps=first_mps)
                if max(own_mps, ceiling_mps) < lowest_mps:
                    lowest_mps = max(own_mps, ceiling_mps)
                    reason, lowest_id = f"track {track_id}: lost", None
        if lowest_mps >= maximum_mps:
            return GovernedSpeed(maximum_mps, "robot maximum", suffices, lowest_mps), kept
        return GovernedSpeed(lowest_mps, reason, suffices, lowest_mps, lowest_id), kept

    def courses(
        self, robot_state: RobotState, robot_age_s: float
    ) -> tuple[Course, tuple[Course, ...]]:
        """Return the straight course, and those that count for the reach."""
        straight = straight_course_of(self._robot, robot_state, robot_age_s)
        if self._turn_rad is None:
            return straight, ()
        return straight, courses_of(self._robot, robot_state, self._turn_rad, robot_age_s)

    def person_mps(
        self,
        person: Person,
        straight: Course,
        courses: tuple[Course, ...],
        now: float,
        counts_mps: float = math.inf,
    ) -> tuple[float, str]:
        """Return the limit that one person sets, infinite for none, and the rule.

        A limit of ``counts_mps`` or more may be any other such one.
        """
        lowest_mps, rule = straight.maximum_mps, "in the path"
        body_m = BODY_RADIUS_M + self._people.sigmas(person, now) * person.sigma_m
        aged = straight._replace(
            reaction_s=straight.reaction_s + max(now - person.track.stamp_s, 0.0)
        )
        # The nearer of predicted and tracked position counts: the person may have stopped.
        for place_m in {person.position_odom_m, person.track_position_odom_m}:
            path_mps = in_the_path_mps(place_m, body_m, self._clearance_m, aged)
            lowest_mps = min(lowest_mps, path_mps)
        reach = self._people.reach(person, now)
        if reach is not None:
            reach_mps = counts_mps
            for course in courses:
                reach_mps = limit_mps(reach, course, reach_mps)
            if reach.walks_faster:
                # Whoever keeps to their motion is not met by a robot that keeps to its own.
                reach_mps = limit_mps(reach.walking_on(), straight, reach_mps)
            if reach_mps <= lowest_mps:
                lowest_mps, rule = reach_mps, "reach"
        return (math.inf if lowest_mps >= straight.maximum_mps else lowest_mps), rule

    def _stops_in_time(
        self,
        person: Person,
        straight: Course,
        courses: tuple[Course, ...],
        speed_mps: float,
        now: float,
    ) -> bool:
        """Return whether a robot that brakes fully from now on stops before it meets a person."""
        reach = self._people.reach(person, now)
        if reach is not None:
            return all(stops_in_time(reach, course, speed_mps) for course in courses)
        own_mps, _ = self.person_mps(person, straight._replace(reaction_s=0.0), (), now)
        return speed_mps <= own_mps
