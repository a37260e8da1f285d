"""The speed limit: the smallest limit of all rules and all people."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, TypeAlias

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

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
    protective_separation_m,
)

# Below this speed the robot counts as standing: it may start off either way, or turn on the spot.
STANDING_MPS: Final = 0.05
# Shares of the speed that is assumed for unaware people. A person faster than the first share is a
# brisk walker, who may turn to the robot. A person faster than that speed by the second share runs.
BRISK_SHARE: Final = 0.75
RUNNING_SHARE: Final = 0.25


# Gaps and shares of the stopping distance (2, N); human speeds, ages and start delays (N,).
_Terms: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


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
        self._human_acceleration_mps2 = (
            math.inf if standing is None else standing.human_acceleration_mps2
        )
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
        suffices = speed_mps <= lowest[0][0] or self._braking_suffices(*terms, speed_mps)
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
        terms = gaps_m, shares, human_mps, age_s, delay_s
        limits = {
            "speed and separation": self._separation_limit_mps(*terms),
            **self._rule_limits_mps(gaps_m, shares[1]),
        }
        if self._policy.rules.start_reserve is not None:
            limits["start reserve"] = self._start_limit_mps(gaps_m, people, robot_state, age_s)
        return limits, terms

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

    def _separation_limit_mps(
        self,
        gaps_m: FloatArray,
        shares: FloatArray,
        human_mps: FloatArray,
        age_s: FloatArray,
        delay_s: FloatArray,
    ) -> FloatArray:
        """Return (N,), the higher limit of the two bounds for each person."""
        arguments = (
            gaps_m,
            human_mps,
            self._robot.max_deceleration_mps2,
            self._robot.reaction_time_s + age_s,
            self._policy.margins.separation_clearance_m,
            shares,
        )
        if np.isfinite(delay_s).any():
            limits_mps = highest_speed_from_standing_mps(
                *arguments, self._human_acceleration_mps2, delay_s
            )
        else:
            limits_mps = highest_speed_mps(*arguments)
        return np.asarray(np.maximum(limits_mps[0], limits_mps[1]))

    def _start_limit_mps(
        self,
        gaps_m: FloatArray,
        people: Mapping[int, PersonMemory],
        robot_state: RobotState,
        age_s: FloatArray,
    ) -> FloatArray:
        """Return (N,), the limit with which the robot stands before anybody who sets off now."""
        reserve = self._policy.rules.start_reserve
        assert reserve is not None
        positions = np.array([m.track_position_odom_m for m in people.values()])
        offset = positions - robot_state.position_odom_m
        distance_m = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
        shares = np.ones_like(gaps_m)
        shares[1] = _ahead(offset, distance_m, robot_state)
        # Whoever comes already has been speeding up for as long as that takes.
        velocity = np.array([m.velocity_odom_mps for m in people.values()])
        closing_mps = np.maximum(-(velocity * offset).sum(axis=1) / distance_m, 0.0)
        delay_s = reserve.start_delay_s + closing_mps / reserve.human_acceleration_mps2
        limits_mps = highest_speed_from_standing_mps(
            gaps_m,
            np.full(len(people), self._rules.unaware_human_speed_mps),
            self._robot.max_deceleration_mps2,
            self._robot.reaction_time_s + age_s,
            0.0,
            shares,
            reserve.human_acceleration_mps2,
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

    def _braking_suffices(
        self,
        gaps_m: FloatArray,
        shares: FloatArray,
        human_mps: FloatArray,
        age_s: FloatArray,
        delay_s: FloatArray,
        speed_mps: float,
    ) -> bool:
        """Return whether the robot stops in time if it brakes fully from now on.

        No reaction time is left then. For a standing robot it is always True.
        """
        if speed_mps < STANDING_MPS:
            return True
        needed_m = protective_separation_m(
            speed_mps,
            human_mps,
            deceleration_mps2=self._robot.max_deceleration_mps2,
            reaction_time_s=age_s,
            clearance_m=self._policy.margins.separation_clearance_m,
            approach=shares,
            human_acceleration_mps2=self._human_acceleration_mps2,
            start_delay_s=delay_s,
        )
        return bool((needed_m <= gaps_m).any(axis=0).all())

    def _human_speed_mps(self, memory: PersonMemory, robot_x: float, robot_y: float) -> float:
        """Return the assumed speed of a person towards the robot.

        It is the policy's assumption, or the closing speed of the track if that is higher: an aware
        person is not expected to step towards the robot, but may do so. Speed above that assumed
        for unaware people is added, since an attentive runner cannot stop as fast as an attentive
        walker. From a quarter above it on, awareness no longer counts: a running person is assumed
        to run straight at the robot. With a protective field it is the assumption alone.
        """
        (x, y), (vx, vy) = memory.track_position_odom_m, memory.velocity_odom_mps
        x, y = x - robot_x, y - robot_y
        assumed_mps = self._rules.human_speed_mps(memory)
        if self._path is not None:
            return assumed_mps
        distance_m = max(math.hypot(x, y), 1e-9)
        closing_mps = -(vx * x + vy * y) / distance_m
        walking_mps, unaware_mps = math.hypot(vx, vy), self._rules.unaware_human_speed_mps
        if walking_mps > BRISK_SHARE * unaware_mps:
            across_mps = abs(vx * y - vy * x) / distance_m
            closing_mps = self._closing_after_turn_mps(closing_mps, across_mps, walking_mps)
        excess_mps = walking_mps - unaware_mps
        if excess_mps > 0.0:
            running = min(excess_mps / max(RUNNING_SHARE * unaware_mps, 1e-9), 1.0)
            runner_mps = assumed_mps + running * (walking_mps - assumed_mps)
            assumed_mps = max(assumed_mps + excess_mps, runner_mps)
        return closing_mps if closing_mps > assumed_mps else assumed_mps

    def _closing_after_turn_mps(
        self, closing_mps: float, across_mps: float, walking_mps: float
    ) -> float:
        """Return the closing speed of a brisk walker after the largest turn towards the robot.

        A person at normal pace who has seen the robot stops within a step. A faster one walks on,
        and may be rounding a corner.
        """
        unaware_mps = self._rules.unaware_human_speed_mps
        brisk = (walking_mps / max(unaware_mps, 1e-9) - BRISK_SHARE) / (1.0 - BRISK_SHARE)
        turn_rad = self._people_turn_rad * min(brisk, 1.0)
        if math.atan2(across_mps, closing_mps) <= turn_rad:
            return walking_mps
        return closing_mps * math.cos(turn_rad) + across_mps * math.sin(turn_rad)


def _ahead(
    offset_odom_m: FloatArray, distance_m: FloatArray, robot_state: RobotState
) -> FloatArray:
    """Return (N,), the cosine of each point's angle off the course, at least 0; 1 at a stand."""
    if robot_state.travel_mps < STANDING_MPS:
        return np.ones(len(offset_odom_m))
    along = offset_odom_m @ np.asarray(robot_state.travel_direction_odom)
    return np.asarray(np.clip(along / distance_m, 0.0, 1.0))
