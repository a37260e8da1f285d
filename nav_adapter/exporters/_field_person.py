"""One person as the speed field needs them: where they are at later times, and what counts then."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray
from tracking.prediction import PredictionModel

from .._approach import BRISK_SHARE, RUNNING_SHARE
from .._memory import ROUNDING_S, PersonMemory, position_sigma_m
from .._policy import AwarenessPolicy
from .._predicted import predicted_sigmas_m
from .._robot import RobotProfile

# A sighting that is nearly too old for trust counts as too old: stamps are rounded.
_SAME_AGE_S: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Reach:
    """The distance between a robot and a person from which on the person allows it a speed.

    It is a polynomial of the speed in m/s: an upper bound for all rules of the policy, for every
    direction of robot and person, and for every time.

    Attributes:
        fixed_m: the part that does not depend on the speed.
        linear_s: the factor of the speed.
        square_s2pm: the factor of its square.
    """

    fixed_m: float
    linear_s: float
    square_s2pm: float

    def distance_m(self, speed_mps: float) -> float:
        """Return the distance for a speed."""
        return self.fixed_m + speed_mps * (self.linear_s + speed_mps * self.square_s2pm)


@dataclass(frozen=True, slots=True)
class PersonAhead:
    """One person at T times. A number stands for one that is the same at all times.

    Attributes:
        track_id: of the person.
        place_m: (T, 2) predicted position in odom.
        track_place_m: (T, 2) position of the track at its own stamp; ``place_m`` itself where that
            is no other.
        margin_m: body radius and uncertainty of the position.
        age_s: of the track.
        human_mps: assumed speed towards the robot, whatever the direction.
        walking_mps: of the track.
        velocity_mps: likewise.
        turn_rad: turn towards the robot that counts.
        start_delay_s: infinite for people who walk at once.
        turn_delay_s: infinite for people who turn at once.
        velocity_spread_mps: of people who have to turn.
        lost_mps: (T,) limit that a lost person allows at least, or None.
    """

    track_id: int
    place_m: FloatArray
    track_place_m: FloatArray
    margin_m: float | FloatArray
    age_s: float | FloatArray
    human_mps: float | FloatArray
    walking_mps: float
    velocity_mps: tuple[float, float]
    turn_rad: float
    start_delay_s: float
    turn_delay_s: float
    velocity_spread_mps: float
    lost_mps: FloatArray | None

    @property
    def is_aged(self) -> bool:
        """Return whether the track is somewhere else at its own stamp."""
        return self.place_m is not self.track_place_m

    @property
    def least_mps(self) -> float:
        """Return the lowest speed that is assumed at any time."""
        return _extreme(np.min, self.human_mps)

    def reach(self, policy: AwarenessPolicy, robot: RobotProfile) -> Reach:
        """Return the distance from which on the person allows the robot a speed."""
        rules, a = policy.rules, robot.max_deceleration_mps2
        human_mps = max(
            _extreme(np.max, self.human_mps), self.walking_mps, policy.speed.human_speed_mps(0.0)
        )
        reaction_s = robot.reaction_time_s + _extreme(np.max, self.age_s)
        fixed_m = policy.margins.separation_clearance_m + human_mps * reaction_s
        linear_s = human_mps / a + reaction_s
        if rules.zones is not None:
            span_m = rules.zones.full_speed_beyond_m - rules.zones.stop_within_m
            fixed_m = max(fixed_m, rules.zones.stop_within_m)
            linear_s = max(linear_s, span_m / robot.max_speed_mps)
        if rules.near_cap is not None:
            fixed_m = max(fixed_m, rules.near_cap.within_m)
        body_m = robot.circumscribed_radius_m + _extreme(np.max, self.margin_m)
        return Reach(fixed_m + body_m, linear_s, 0.5 / a)


class Foresight:
    """Looks ahead: what the adapter will know and assume of people who go straight on.

    Args:
        policy: the policy.
        stamp_s: of the constraints.
        times_s: (T,) after the stamp.
        aware_for_s: how long awareness counts.
        prediction: of the adapter; None if places ahead are as certain as the present one.
    """

    def __init__(
        self,
        policy: AwarenessPolicy,
        stamp_s: float,
        times_s: FloatArray,
        aware_for_s: float,
        prediction: PredictionModel | None,
    ) -> None:
        self._policy = policy
        self._stamp_s, self._times_s = stamp_s, times_s
        self._aware_for_s = aware_for_s
        self._prediction = prediction
        self._unaware_mps = policy.speed.human_speed_mps(0.0)

    def person(
        self, track_id: int, memory: PersonMemory, *, is_shown: bool, lost_mps: FloatArray | None
    ) -> PersonAhead:
        """Return a person at all times.

        Args:
            track_id: of the person.
            memory: of the adapter.
            is_shown: whether their track is in the input.
            lost_mps: (T,) limit that they allow at least, if they are lost.
        """
        place_m, track_place_m = self._places_m(memory, is_shown)
        unseen = self._unseen(memory, is_shown)
        age_s = max(0.0, self._stamp_s - memory.track.stamp_s)
        human_mps = self._assumed_mps(memory, unseen)
        walking_mps = math.hypot(*memory.velocity_odom_mps)
        turns = unseen is None and self._may_gain(memory, walking_mps, _extreme(np.max, human_mps))
        turn_rad = 0.0
        if self._policy.rules.protective_field is None:
            human_mps = self._with_excess_mps(human_mps, walking_mps)
            turn_rad = self._turn_rad(walking_mps)
        return PersonAhead(
            track_id=track_id,
            place_m=place_m,
            track_place_m=track_place_m,
            margin_m=self._margin_m(memory, unseen, age_s, is_shown),
            age_s=age_s if is_shown else age_s + self._times_s,
            human_mps=human_mps,
            walking_mps=walking_mps,
            velocity_mps=memory.velocity_odom_mps,
            turn_rad=turn_rad,
            start_delay_s=memory.start_delay_s if unseen is None else math.inf,
            turn_delay_s=memory.turn_delay_s if turns else math.inf,
            velocity_spread_mps=memory.velocity_spread_mps,
            lost_mps=lost_mps,
        )

    def _places_m(self, memory: PersonMemory, is_shown: bool) -> tuple[FloatArray, FloatArray]:
        """Return (T, 2), the predicted position, and that of the track at its own stamp."""
        moved_m = self._times_s[:, None] * np.array(memory.velocity_odom_mps)
        place_m = np.array(memory.position_odom_m) + moved_m
        if is_shown and memory.track_position_odom_m == memory.position_odom_m:
            return place_m, place_m
        track_m = np.array(memory.track_position_odom_m)
        return place_m, track_m + (moved_m if is_shown else 0.0 * moved_m)

    def _unseen(self, memory: PersonMemory, is_shown: bool) -> NDArray[np.bool_] | None:
        """Return (T,) whether the last sighting is too old for trust; None for a person seen now.

        It assumes that no later frame shows a person who is not seen now.
        """
        track, fresh_s = memory.track, self._policy.timing.fresh_within_s - _SAME_AGE_S
        seen_stamp_s = min(memory.seen_stamp_s, track.stamp_s - track.time_since_seen_s)
        unseen_s = self._stamp_s - seen_stamp_s
        if is_shown and track.status != "coasting" and unseen_s <= fresh_s:
            return None
        return np.asarray(unseen_s + self._times_s > fresh_s)

    def _margin_m(
        self,
        memory: PersonMemory,
        unseen: NDArray[np.bool_] | None,
        age_s: float,
        is_shown: bool,
    ) -> float | FloatArray:
        """Return body radius and uncertainty of the position."""
        margins = self._policy.margins
        sigmas: float | FloatArray = margins.uncertainty_sigmas
        sigma_m: float | FloatArray = memory.sigma_m
        if unseen is not None:
            sigmas = np.where(unseen, np.maximum(sigmas, margins.unseen_sigmas), sigmas)
            sigma_m = np.maximum(sigma_m, self._later_sigmas_m(memory, age_s, is_shown))
        if self._prediction is not None:
            ahead_m = predicted_sigmas_m(memory.track, age_s + self._times_s, self._prediction)
            sigma_m = np.maximum(sigma_m, ahead_m)
        return BODY_RADIUS_M + sigmas * sigma_m

    def _later_sigmas_m(self, memory: PersonMemory, age_s: float, is_shown: bool) -> FloatArray:
        """Return (T,), the deviation of a position that nobody measures again."""
        track, stop_after_s = memory.track, self._policy.timing.stop_after_s
        if is_shown:
            until_s = track.stamp_s + min(age_s, stop_after_s) + self._times_s
        else:
            until_s = np.minimum(self._stamp_s + self._times_s, track.stamp_s + stop_after_s)
        return np.array([position_sigma_m(track, until) for until in until_s.tolist()])

    def _assumed_mps(
        self, memory: PersonMemory, unseen: NDArray[np.bool_] | None
    ) -> float | FloatArray:
        """Return the speed that the policy assumes for a person, as the adapter's rules do."""
        policy, unaware_mps = self._policy, self._unaware_mps
        if memory.known_s < policy.timing.shrink_after_s - ROUNDING_S:
            human_mps: float | FloatArray = unaware_mps
        else:
            held = memory.speed_held
            human_mps = policy.speed.human_speed_mps(1.0 if held else memory.awareness_lower)
        if unseen is not None:
            human_mps = np.where(unseen, np.maximum(human_mps, unaware_mps), human_mps)
        if self._aware_for_s < self._times_s[-1]:
            forgets = self._times_s > self._aware_for_s
            human_mps = np.where(forgets, np.maximum(human_mps, unaware_mps), human_mps)
        return human_mps

    def _with_excess_mps(
        self, assumed_mps: float | FloatArray, walking_mps: float
    ) -> float | FloatArray:
        """Return the assumed speed of a person who may walk faster than an unaware one."""
        excess_mps = walking_mps - self._unaware_mps
        if excess_mps <= 0.0:
            return assumed_mps
        running = min(excess_mps / max(RUNNING_SHARE * self._unaware_mps, 1e-9), 1.0)
        runner_mps = assumed_mps + running * (walking_mps - assumed_mps)
        faster_mps: float | FloatArray = np.maximum(assumed_mps + excess_mps, runner_mps)
        return faster_mps

    def _turn_rad(self, walking_mps: float) -> float:
        """Return the turn towards the robot that counts for a brisk walker."""
        unaware_mps = self._unaware_mps
        if walking_mps <= BRISK_SHARE * unaware_mps:
            return 0.0
        brisk = (walking_mps / max(unaware_mps, 1e-9) - BRISK_SHARE) / (1.0 - BRISK_SHARE)
        return math.radians(self._policy.rules.people_turn_deg) * min(brisk, 1.0)

    def _may_gain(self, memory: PersonMemory, walking_mps: float, human_mps: float) -> bool:
        """Return whether time to turn counts for somebody who walks straight away from a pose."""
        rules = self._policy.rules
        if rules.walking is None:
            return False
        a_h, since_s = rules.walking.human_acceleration_mps2, memory.turn_delay_s
        best_s = since_s + (memory.velocity_spread_mps - walking_mps) / a_h
        if rules.start_reserve is not None and best_s < rules.start_reserve.start_delay_s:
            return True
        # The way of a walker at this speed is longer by so much in the end.
        human_mps = max(human_mps, walking_mps)
        saved_m = human_mps * (0.5 * human_mps / a_h - best_s)
        return saved_m > 0.5 * a_h * (since_s**2 - max(best_s, 0.0) ** 2)


def _extreme(of: Callable[[FloatArray], Any], values: float | FloatArray) -> float:
    return values if isinstance(values, float) else float(of(values))
