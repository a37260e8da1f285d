"""The speed limit: for each person the smallest of all rules, and of those the smallest."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._footprint import Footprint
from ._memory import PersonMemory
from ._obstacle_rules import ObstacleRules
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState
from ._separation import highest_speed_mps, protective_separation_m

# A robot that stands may start off either way, or turn on the spot.
_STANDING_MPS: Final = 0.05
# Who walks at more than this share of the speed assumed of the unaware may turn to the robot; who
# is faster than it by the second share runs.
_BRISK_SHARE: Final = 0.75
_RUNNING_SHARE: Final = 0.25
_RULES: Final = ("speed and separation", "distance zone", "cap near people")


@dataclass(frozen=True, slots=True)
class GovernedSpeed:
    """A limit and where it comes from.

    Attributes:
        limit_mps: ≥ 0.
        limited_by: person and rule, or the robot's maximum.
        braking_suffices: whether a robot that brakes from now on stands in time.
    """

    limit_mps: float
    limited_by: str
    braking_suffices: bool


class SpeedGovernor:
    """Turns people into a speed limit.

    Separations run from the robot to a person's body circle (radius 0.30 m), less the uncertainty
    of their position (more of it for people out of sight) and the way driven since the robot's
    state. Two bounds on how near the robot comes while it stops are known, and the better one
    counts:

    - it comes nearer by its stopping distance at most, measured from its footprint;
    - where it turns by at most ``turn_within_stop_deg`` off its direction of travel while it stops,
      it comes nearer by the stopping distance × cos(angle beyond that) at most, since no piece of
      its path leads more directly to the person. Turned corners stay within the circumscribed
      circle, from which this separation is measured.

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
        self._people_turn_rad = math.radians(policy.rules.people_turn_deg)

    def limit(
        self,
        people: Mapping[int, PersonMemory],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> GovernedSpeed:
        """The limit at ``now`` for a robot whose state is ``robot_age_s`` old."""
        maximum_mps = self._robot.max_speed_mps
        if not people:
            return GovernedSpeed(maximum_mps, "robot maximum", True)
        count = len(people)
        lost_m = BODY_RADIUS_M + abs(robot_state.speed_mps) * robot_age_s
        # Carrying a person on may only bring them nearer: they may have turned round since.
        positions = np.array(
            [m.here_odom_m for m in people.values()] + [m.place_odom_m for m in people.values()]
        )
        robot_x, robot_y = robot_state.position_odom_m.tolist()
        rows = [
            (
                lost_m + self._doubt_m(m, now),
                max(0.0, now - m.track.stamp_s),
                self._human_speed_mps(m, robot_x, robot_y),
            )
            for m in people.values()
        ]
        lost, age_s, human_mps = np.array(rows).T.copy()
        offset = positions - robot_state.position_odom_m
        # Both bounds on the separation: from the footprint, and from the circle about the robot.
        gaps_m = np.empty((2, count))
        ahead_m = self._footprint.distance_m(positions, robot_state)
        np.minimum(ahead_m[:count], ahead_m[count:], out=gaps_m[0])
        around_m = np.hypot(offset[:, 0], offset[:, 1])
        np.minimum(around_m[:count], around_m[count:], out=gaps_m[1])
        gaps_m[1] -= self._robot.circumscribed_radius_m
        gaps_m -= lost
        approach = self._approach(offset, robot_state, robot_age_s)
        shares = np.ones((2, count))
        np.maximum(approach[:count], approach[count:], out=shares[1])

        separation_mps = self._separation_limit_mps(gaps_m, shares, human_mps, age_s)
        limits = [separation_mps, *self._rule_limits_mps(gaps_m, shares[1])]
        lowest = [(float(limit[who]), who) for limit in limits for who in (int(limit.argmin()),)]
        limit_mps, person = min(lowest, key=lambda entry: entry[0])
        speed_mps = abs(robot_state.speed_mps)
        # Who keeps to speed and separation has the whole reaction time left.
        suffices = speed_mps <= lowest[0][0] or self._braking_suffices(
            gaps_m, shares, human_mps, age_s, speed_mps
        )
        if limit_mps >= maximum_mps:
            return GovernedSpeed(maximum_mps, "robot maximum", suffices)
        names = [name for name, used in zip(_RULES, self._rules_used(), strict=True) if used]
        rule = lowest.index((limit_mps, person))
        return GovernedSpeed(limit_mps, f"track {list(people)[person]}: {names[rule]}", suffices)

    def _doubt_m(self, memory: PersonMemory, now: float) -> float:
        """How much nearer than estimated a person may be."""
        margins = self._policy.margins
        sigmas = margins.uncertainty_sigmas
        if now - memory.seen_stamp_s > self._policy.timing.fresh_within_s:
            sigmas = max(sigmas, margins.unseen_sigmas)
        return sigmas * memory.sigma_m

    def _rules_used(self) -> tuple[bool, bool, bool]:
        rules = self._policy.rules
        return True, rules.zones is not None, rules.near_cap is not None

    def _approach(
        self, offset_odom_m: FloatArray, robot_state: RobotState, robot_age_s: float
    ) -> FloatArray:
        """(N,) share of its stopping distance by which the robot can come nearer to each point."""
        if abs(robot_state.speed_mps) < _STANDING_MPS:
            return np.ones(len(offset_odom_m))
        heading = robot_state.heading_odom_rad
        sign = math.copysign(1.0, robot_state.speed_mps)
        travel_x, travel_y = sign * math.cos(heading), sign * math.sin(heading)
        x, y = offset_odom_m.T
        off_rad = np.abs(np.arctan2(travel_x * y - travel_y * x, travel_x * x + travel_y * y))
        turned_rad = self._turn_rad + abs(robot_state.yaw_rate_radps) * robot_age_s
        beyond_rad = np.maximum(off_rad - turned_rad, 0.0)
        return np.asarray(np.maximum(np.cos(beyond_rad), 0.0))

    def _separation_limit_mps(
        self, gaps_m: FloatArray, shares: FloatArray, human_mps: FloatArray, age_s: FloatArray
    ) -> FloatArray:
        limits_mps = highest_speed_mps(
            gaps_m,
            human_mps,
            self._robot.max_deceleration_mps2,
            self._robot.reaction_time_s + age_s,
            self._policy.margins.separation_clearance_m,
            shares,
        )
        return np.asarray(np.maximum(limits_mps[0], limits_mps[1]))

    def _rule_limits_mps(self, gaps_m: FloatArray, approach: FloatArray) -> list[FloatArray]:
        """The limits of the rules that the policy has."""
        rules, limits, (ahead_m, around_m) = self._policy.rules, [], gaps_m
        if rules.zones is not None:
            # How far the robot may drive until it has come so near.
            way_m = np.divide(
                around_m, approach, out=np.full_like(approach, np.inf), where=approach > 0.0
            )
            reach_m = np.maximum(ahead_m, np.where(around_m > 0.0, way_m, around_m))
            limits.append(rules.zones.limit_mps(reach_m, self._robot.max_speed_mps))
        if rules.near_cap is not None:
            limits.append(rules.near_cap.limit_mps(ahead_m, self._robot.max_deceleration_mps2))
        return limits

    def _braking_suffices(
        self,
        gaps_m: FloatArray,
        shares: FloatArray,
        human_mps: FloatArray,
        age_s: FloatArray,
        speed_mps: float,
    ) -> bool:
        """Whether the separations are enough for full braking from now on, reaction time used up.

        A robot that stands has done what it can.
        """
        if speed_mps < _STANDING_MPS:
            return True
        needed_m = protective_separation_m(
            speed_mps,
            human_mps,
            deceleration_mps2=self._robot.max_deceleration_mps2,
            reaction_time_s=age_s,
            clearance_m=self._policy.margins.separation_clearance_m,
            approach=shares,
        )
        return bool((needed_m <= gaps_m).any(axis=0).all())

    def _human_speed_mps(self, memory: PersonMemory, robot_x: float, robot_y: float) -> float:
        """The policy's assumption, but at least the speed at which the track may close in.

        Awareness is a reason to expect that somebody will not step towards the robot, not a reason
        to overlook that they do. What a person walks faster than an unaware one may is added: an
        attentive runner cannot stop as fast as an attentive walker. Of somebody a quarter faster
        than that, awareness is a reason for nothing: who runs is assumed to run at the robot.
        """
        (x, y), (vx, vy) = memory.place_odom_m, memory.velocity_odom_mps
        x, y = x - robot_x, y - robot_y
        assumed_mps = self._rules.human_speed_mps(memory)
        distance_m = max(math.hypot(x, y), 1e-9)
        closing_mps = -(vx * x + vy * y) / distance_m
        walking_mps, unaware_mps = math.hypot(vx, vy), self._rules.unaware_human_speed_mps
        if walking_mps > _BRISK_SHARE * unaware_mps:
            across_mps = abs(vx * y - vy * x) / distance_m
            closing_mps = self._turned_mps(closing_mps, across_mps, walking_mps)
        excess_mps = walking_mps - unaware_mps
        if excess_mps > 0.0:
            running = min(excess_mps / max(_RUNNING_SHARE * unaware_mps, 1e-9), 1.0)
            runner_mps = assumed_mps + running * (walking_mps - assumed_mps)
            assumed_mps = max(assumed_mps + excess_mps, runner_mps)
        return closing_mps if closing_mps > assumed_mps else assumed_mps

    def _turned_mps(self, closing_mps: float, across_mps: float, walking_mps: float) -> float:
        """Speed towards the robot of a brisk walker who turns to it as far as may be.

        Somebody at normal pace who has seen the robot stops within a step; who is faster carries on
        and may be rounding a corner just now.
        """
        unaware_mps = self._rules.unaware_human_speed_mps
        brisk = (walking_mps / max(unaware_mps, 1e-9) - _BRISK_SHARE) / (1.0 - _BRISK_SHARE)
        turn_rad = self._people_turn_rad * min(brisk, 1.0)
        if math.atan2(across_mps, closing_mps) <= turn_rad:
            return walking_mps
        return closing_mps * math.cos(turn_rad) + across_mps * math.sin(turn_rad)
