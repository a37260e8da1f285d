"""The speed limit: the smallest limit of all rules and all people."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, TypeAlias

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._approach import Turn, human_speed_mps, turn_of
from ._constraints import GovernedSpeed
from ._footprint import Footprint
from ._memory import PersonMemory
from ._obstacle_rules import ObstacleRules
from ._policy import AwarenessPolicy
from ._protective_field import StraightPath
from ._robot import LATERAL_NOISE_MPS, RobotProfile, RobotState
from ._separation import (
    highest_speed_from_standing_mps,
    highest_speed_mps,
    separation_from_standing_m,
)
from .policies import StartReserve

# Below this speed the robot counts as standing: it may start off either way, or turn on the spot.
STANDING_MPS: Final = 0.05
# The two bounds, and that from the circumscribed circle once more.
_TWO_AND_CIRCLE: Final = [0, 1, 1]

# Gaps and shares of the stopping distance (2, N); human speeds, ages and start delays (N,); the
# bound for people who must turn to the robot, or None if it holds for nobody.
_Terms: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, Turn | None]


class SpeedGovernor:
    """Computes the speed limit for the people around the robot.

    A separation runs from the robot to a person's body circle (radius 0.30 m), less the uncertainty
    of the position (with more standard deviations for unseen people) and the distance driven since
    the robot's state. There are two bounds on how much nearer the robot comes while it stops, and
    the one that allows more speed counts:

    - It comes nearer by at most its stopping distance, measured from its footprint.
    - If it turns by at most ``turn_within_stop_deg`` off its direction of travel while it stops, it
      comes nearer by at most the stopping distance × cos(angle beyond that), since no part of its
      path leads more directly to the person. Corners stay within the circumscribed circle when the
      robot turns, so this separation is measured from that circle.

    Args:
        policy: margins and rules.
        robot: footprint, braking and reaction time.
        rules: gives the human speeds.
    """

    def __init__(self, policy: AwarenessPolicy, robot: RobotProfile, rules: ObstacleRules) -> None:
        self._policy = policy
        self._robot = robot
        self._rules = rules
        self._footprint = Footprint(robot.footprint_m)
        self._turn_rad = math.radians(policy.rules.turn_within_stop_deg)
        field = policy.rules.protective_field
        self._path = None if field is None else StraightPath(robot.footprint_m, field.beside_m)
        standing = policy.rules.standing
        walking = policy.rules.walking
        self._turn_acceleration_mps2 = (
            math.inf if walking is None else walking.human_acceleration_mps2
        )
        self._human_acceleration_mps2 = (
            math.inf if standing is None else standing.human_acceleration_mps2
        )
        # For people who start, twice, and who turn: (3, 1).
        both = [self._human_acceleration_mps2] * 2
        self._human_accelerations_mps2 = np.array([*both, self._turn_acceleration_mps2])[:, None]
        self._people_turn_rad = math.radians(policy.rules.people_turn_deg)

    def limit(
        self,
        people: Mapping[int, PersonMemory],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> GovernedSpeed:
        """Return the limit at ``now`` for a robot whose state is ``robot_age_s`` old."""
        maximum_mps = self._robot.max_speed_mps
        if self._path is not None:
            people = self._people_in(self._path, people, robot_state, now)
        if not people:
            return GovernedSpeed(maximum_mps, "robot maximum", True, math.inf)
        limits, terms = self._limits_mps(people, robot_state, now, robot_age_s)
        lowest = []
        for rule, limit in limits.items():
            row = int(limit.argmin())
            lowest.append((float(limit[row]), row, rule))
        limit_mps, row, rule = min(lowest, key=lambda entry: entry[0])
        speed_mps = robot_state.travel_mps
        # A robot within speed and separation has the whole reaction time left.
        suffices = speed_mps <= lowest[0][0] or self._braking_suffices(terms, speed_mps)
        if limit_mps >= maximum_mps:
            return GovernedSpeed(maximum_mps, "robot maximum", suffices, limit_mps)
        reason = f"track {list(people)[row]}: {rule}"
        return GovernedSpeed(limit_mps, reason, suffices, limit_mps)

    def limits_mps(
        self,
        people: Mapping[int, PersonMemory],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> list[float]:
        """Return the limit that each person sets alone, in their order."""
        maximum_mps, inside = self._robot.max_speed_mps, people
        if self._path is not None:
            inside = self._people_in(self._path, people, robot_state, now)
        if not inside:
            return [maximum_mps] * len(people)
        limits, _ = self._limits_mps(inside, robot_state, now, robot_age_s)
        lowest_mps = np.minimum(np.stack(list(limits.values())).min(axis=0), maximum_mps)
        found = dict(zip(inside, lowest_mps.tolist(), strict=True))
        return [found.get(track_id, maximum_mps) for track_id in people]

    def _limits_mps(
        self,
        people: Mapping[int, PersonMemory],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> tuple[dict[str, FloatArray], _Terms]:
        """Return the limits (N,) for each person by the name of the rule, and their terms.

        Speed and separation comes first.
        """
        gaps_m, shares = self._gaps(people, robot_state, now, robot_age_s)
        robot_x, robot_y = robot_state.position_odom_m.tolist()
        rows = [
            (
                max(0.0, now - m.track.stamp_s),
                self._human_speed_mps(m, robot_x, robot_y),
                m.start_delay_s,
            )
            for m in people.values()
        ]
        age_s, human_mps, delay_s = np.array(rows).T.copy()
        reserve, turn = self._policy.rules.start_reserve, None
        if reserve is not None or self._policy.rules.walking is not None:
            closing_mps, ahead = _closing(people, robot_state)
            turn = self._turn(people, closing_mps, age_s)
        terms = gaps_m, shares, human_mps, age_s, delay_s, turn
        limits = {
            "speed and separation": self._separation_limit_mps(terms),
            **self._rule_limits_mps(gaps_m, shares[1]),
        }
        if reserve is not None:
            limits["start reserve"] = self._start_limit_mps(reserve, terms, closing_mps, ahead)
        return limits, terms

    def _human_speed_mps(self, memory: PersonMemory, robot_x: float, robot_y: float) -> float:
        """Return the assumed speed of a person towards the robot."""
        assumed_mps = self._rules.human_speed_mps(memory)
        if self._path is not None:
            return assumed_mps
        return human_speed_mps(
            memory,
            robot_x,
            robot_y,
            assumed_mps=assumed_mps,
            unaware_mps=self._rules.unaware_human_speed_mps,
            turn_rad=self._people_turn_rad,
        )

    def _people_in(
        self,
        path: StraightPath,
        people: Mapping[int, PersonMemory],
        robot_state: RobotState,
        now: float,
    ) -> dict[int, PersonMemory]:
        """Return the people in the path at their tracked or at their predicted position."""
        return {
            track_id: memory
            for track_id, memory in people.items()
            if any(
                path.holds(position, robot_state, self._uncertainty_m(memory, now))
                for position in (memory.track_position_odom_m, memory.position_odom_m)
            )
        }

    def _gaps(
        self,
        people: Mapping[int, PersonMemory],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the separations and the shares of the stopping distance that lead to the people.

        Both are (2, N): by the bound from the footprint, and by that from the circumscribed circle.
        """
        count = len(people)
        base_margin_m = BODY_RADIUS_M + self._driven_m(robot_state, robot_age_s)
        margin_m = np.array([base_margin_m + self._uncertainty_m(m, now) for m in people.values()])
        # The nearer of predicted and tracked position counts: the person may have turned round.
        positions = np.array(
            [m.position_odom_m for m in people.values()]
            + [m.track_position_odom_m for m in people.values()]
        )
        offset = positions - robot_state.position_odom_m
        gaps_m = np.empty((2, count))
        footprint_m = self._footprint.distance_m(positions, robot_state)
        np.minimum(footprint_m[:count], footprint_m[count:], out=gaps_m[0])
        center_m = np.hypot(offset[:, 0], offset[:, 1])
        np.minimum(center_m[:count], center_m[count:], out=gaps_m[1])
        gaps_m[1] -= self._robot.circumscribed_radius_m
        gaps_m -= margin_m
        approach = self._approach(offset, robot_state, robot_age_s)
        shares = np.ones((2, count))
        np.maximum(approach[:count], approach[count:], out=shares[1])
        return gaps_m, shares

    def _driven_m(self, robot_state: RobotState, robot_age_s: float) -> float:
        """Return how far the robot may have driven since its state, speeding up to its maximum."""
        travel_mps = robot_state.travel_mps
        fastest_mps = max(travel_mps, self._robot.max_speed_mps)
        faster_m = 0.5 * self._robot.max_acceleration_mps2 * robot_age_s**2
        return min(travel_mps * robot_age_s + faster_m, fastest_mps * robot_age_s)

    def _uncertainty_m(self, memory: PersonMemory, now: float) -> float:
        """Return by how much a person may be nearer than estimated."""
        margins = self._policy.margins
        sigmas = margins.uncertainty_sigmas
        # The position is that of the track, which may be older than the latest sighting.
        track_seen_s = memory.track.stamp_s - memory.track.time_since_seen_s
        seen_s = min(memory.seen_stamp_s, track_seen_s)
        if now - seen_s > self._policy.timing.fresh_within_s:
            sigmas = max(sigmas, margins.unseen_sigmas)
        return sigmas * memory.sigma_m

    def _approach(
        self, offset_odom_m: FloatArray, robot_state: RobotState, robot_age_s: float
    ) -> FloatArray:
        """Return (N,), the share of the stopping distance that can lead to each point."""
        lateral_mps = abs(robot_state.lateral_mps)
        if abs(robot_state.speed_mps) < STANDING_MPS and lateral_mps <= LATERAL_NOISE_MPS:
            return np.ones(len(offset_odom_m))
        travel_x, travel_y = robot_state.travel_direction_odom
        x, y = offset_odom_m.T
        angle_rad = np.abs(np.arctan2(travel_x * y - travel_y * x, travel_x * x + travel_y * y))
        turn_rad = self._turn_rad + abs(robot_state.yaw_rate_radps) * robot_age_s
        if lateral_mps <= LATERAL_NOISE_MPS and self._robot.moves_sideways is not False:
            # What counts as noise may be motion.
            turn_rad += math.atan2(lateral_mps, abs(robot_state.speed_mps))
        if self._robot.max_acceleration_mps2 * robot_age_s >= robot_state.travel_mps:
            turn_rad = math.pi  # the robot may drive anywhere by now
        beyond_rad = np.maximum(angle_rad - turn_rad, 0.0)
        return np.asarray(np.maximum(np.cos(beyond_rad), 0.0))

    def _turn(
        self, people: Mapping[int, PersonMemory], closing_mps: FloatArray, age_s: FloatArray
    ) -> Turn | None:
        """Return the bound for people who must turn to the robot; None if it holds for nobody."""
        rows = [(memory.turn_delay_s, memory.velocity_spread_mps) for memory in people.values()]
        if all(delay_s == math.inf for delay_s, _ in rows):
            return None
        return turn_of(
            closing_mps,
            np.array([delay_s for delay_s, _ in rows]),
            np.array([spread_mps for _, spread_mps in rows]),
            self._robot.reaction_time_s + age_s,
            self._turn_acceleration_mps2,
        )

    def _separation_limit_mps(self, terms: _Terms) -> FloatArray:
        """Return (N,), the higher limit of the two bounds for each person."""
        gaps_m, shares, human_mps, age_s, delay_s, turn = terms
        robot = (
            human_mps,
            self._robot.max_deceleration_mps2,
            self._robot.reaction_time_s + age_s,
            self._policy.margins.separation_clearance_m,
        )
        accelerations_mps2 = self._human_accelerations_mps2
        if turn is not None:
            # People come nearer to the base, so only the bound from the circle has this one too.
            gaps_m = np.stack([gaps_m[0], gaps_m[1], gaps_m[1] - turn.nearer_m])
            limits_mps = highest_speed_from_standing_mps(
                gaps_m,
                *robot,
                shares[_TWO_AND_CIRCLE],
                accelerations_mps2,
                np.stack([delay_s, delay_s, turn.delay_s]),
            )
        elif np.isfinite(delay_s).any():
            limits_mps = highest_speed_from_standing_mps(
                gaps_m, *robot, shares, accelerations_mps2[:2], delay_s
            )
        else:
            limits_mps = highest_speed_mps(gaps_m, *robot, shares)
        return np.asarray(limits_mps.max(axis=0))

    def _start_limit_mps(
        self, reserve: StartReserve, terms: _Terms, closing_mps: FloatArray, ahead: FloatArray
    ) -> FloatArray:
        """Return (N,), the limit with which the robot stands before anybody who sets off now."""
        gaps_m, _, _, age_s, _, turn = terms
        a_h, reaction_s = reserve.human_acceleration_mps2, self._robot.reaction_time_s + age_s
        # Whoever comes already has been speeding up for as long as that takes.
        delay_s = reserve.start_delay_s + np.maximum(closing_mps, 0.0) / a_h
        if turn is not None and self._turn_acceleration_mps2 <= a_h:
            # Whoever has to turn round is no nearer when the robot brakes, and from then on.
            at_once_m = 0.5 * a_h * (reaction_s + reserve.start_delay_s) ** 2
            later = turn.nearer_m + 0.5 * a_h * (reaction_s + turn.delay_s) ** 2 <= at_once_m
            gaps_m = np.stack([gaps_m[0], gaps_m[1] - np.where(later, turn.nearer_m, 0.0)])
            delay_s = np.stack([delay_s, np.where(later, turn.delay_s, delay_s)])
        limits_mps = highest_speed_from_standing_mps(
            gaps_m,
            np.full(len(age_s), self._rules.unaware_human_speed_mps),
            self._robot.max_deceleration_mps2,
            reaction_s,
            0.0,
            np.stack([np.ones_like(ahead), ahead]),
            a_h,
            delay_s,
        )
        return np.asarray(np.maximum(limits_mps[0], limits_mps[1]))

    def _rule_limits_mps(self, gaps_m: FloatArray, approach: FloatArray) -> dict[str, FloatArray]:
        """Return the limits (N,) of the policy's other rules, by the name of the rule."""
        rules, (footprint_gap_m, circle_gap_m) = self._policy.rules, gaps_m
        limits = {}
        if rules.zones is not None:
            # The distance that the robot drives until it has come nearer by the gap.
            drive_m = np.divide(
                circle_gap_m, approach, out=np.full_like(approach, np.inf), where=approach > 0.0
            )
            drive_m = np.where(circle_gap_m > 0.0, drive_m, circle_gap_m)
            distance_m = np.maximum(footprint_gap_m, drive_m)
            limits["distance zone"] = rules.zones.limit_mps(distance_m, self._robot.max_speed_mps)
        if rules.near_cap is not None:
            deceleration_mps2 = self._robot.max_deceleration_mps2
            limits["cap near people"] = rules.near_cap.limit_mps(footprint_gap_m, deceleration_mps2)
        return limits

    def _braking_suffices(self, terms: _Terms, speed_mps: float) -> bool:
        """Return whether the robot stops in time if it brakes fully from now on.

        No reaction time is left then. For a standing robot it is always True.
        """
        if speed_mps < STANDING_MPS:
            return True
        gaps_m, shares, human_mps, age_s, delay_s, turn = terms
        a, C = self._robot.max_deceleration_mps2, self._policy.margins.separation_clearance_m
        needed_m = separation_from_standing_m(
            speed_mps, human_mps, a, age_s, C, shares, self._human_acceleration_mps2, delay_s
        )
        if turn is not None:
            turned_m = turn.nearer_m + separation_from_standing_m(
                *(speed_mps, human_mps, a, age_s, C, shares[1]),
                self._turn_acceleration_mps2,
                turn.delay_s,
            )
            np.minimum(needed_m[1], turned_m, out=needed_m[1])
        return bool((needed_m <= gaps_m).any(axis=0).all())


def _closing(
    people: Mapping[int, PersonMemory], robot_state: RobotState
) -> tuple[FloatArray, FloatArray]:
    """Return (N,), the speed at which each track comes nearer, and how far ahead it is.

    That is the cosine of its angle off the robot's course, at least 0; 1 at a stand.
    """
    positions = np.array([m.track_position_odom_m for m in people.values()])
    velocity = np.array([m.velocity_odom_mps for m in people.values()])
    offset = positions - robot_state.position_odom_m
    distance_m = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
    closing_mps = -(velocity * offset).sum(axis=1) / distance_m
    if robot_state.travel_mps < STANDING_MPS:
        return closing_mps, np.ones(len(offset))
    along = offset @ np.asarray(robot_state.travel_direction_odom)
    return closing_mps, np.asarray(np.clip(along / distance_m, 0.0, 1.0))
