"""People as the speed field needs them: numbers over time, in groups that need the same terms."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray
from tracking.prediction import PredictionModel

from .._approach import BRISK_SHARE, RUNNING_SHARE
from .._memory import ROUNDING_S, PersonMemory, position_sigma_m
from .._policy import AwarenessPolicy
from .._predicted import predicted_sigmas_m
from .._robot import RobotProfile
from .._speed_basis import SpeedBasis
from ..policies import SpeedRules

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
class PeopleAhead:
    """Some people at T times, all of whom need the same terms.

    Arrays are (N, T), or another shape of three axes that broadcasts with the poses.

    Attributes:
        track_ids: of the N people.
        x: predicted position relative to the reference point, in metres.
        y: the same.
        track_x: position of the track at its own stamp, which may be nearer; None where it is the
            predicted one for all of them.
        track_y: the same.
        margin_m: body radius and uncertainty of the position.
        reaction_s: the robot's reaction time and the age of the track.
        human_mps: assumed speed towards the robot, whatever the direction.
        velocity_x_mps: of the track; None where the direction of walking makes no difference.
        velocity_y_mps: the same.
        turn: cosine and sine of the turn towards the robot that counts, or None.
        start_delay_s: of people who stand, or None for people who walk at once.
        turn_delay_s: of people who have to turn to the robot, or None for people who turn at once.
        velocity_spread_mps: of the same.
        reserved: whether the start reserve can make a difference.
        lost_mps: limit that lost people allow at least, or None.
        reaches: of the N people.
    """

    track_ids: tuple[int, ...]
    x: Any
    y: Any
    track_x: Any
    track_y: Any
    margin_m: Any
    reaction_s: Any
    human_mps: Any
    velocity_x_mps: Any
    velocity_y_mps: Any
    turn: tuple[Any, Any] | None
    start_delay_s: Any
    turn_delay_s: Any
    velocity_spread_mps: Any
    reserved: bool
    lost_mps: Any
    reaches: tuple[Reach, ...]

    def mapped(self, change: Callable[[Any], Any]) -> PeopleAhead:
        """Return the people with ``change`` applied to each of their arrays."""
        arrays = {
            name: change(value) for name in _ARRAYS if (value := getattr(self, name)) is not None
        }
        turn = None if self.turn is None else (change(self.turn[0]), change(self.turn[1]))
        return replace(self, turn=turn, **arrays)


_ARRAYS: Final = (
    *("x", "y", "track_x", "track_y", "margin_m", "reaction_s", "human_mps"),
    *("velocity_x_mps", "velocity_y_mps", "start_delay_s", "lost_mps"),
    *("turn_delay_s", "velocity_spread_mps"),
)


@dataclass(frozen=True, slots=True)
class _Person:
    """One person at T times, before people are put into groups.

    A number stands for one that is the same at all times.
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


def people_ahead(
    basis: SpeedBasis,
    robot: RobotProfile,
    stamp_s: float,
    times_s: FloatArray,
    aware_for_s: float,
    reference_m: FloatArray,
    is_near: Callable[[FloatArray, FloatArray, float], bool],
) -> list[PeopleAhead]:
    """Return the people who may limit the speed, in groups.

    Args:
        basis: of the constraints.
        robot: likewise.
        stamp_s: of the constraints.
        times_s: (T,) after the stamp.
        aware_for_s: how long awareness counts.
        reference_m: (2,) the point that positions are relative to.
        is_near: whether a person in a box, given by two corners (2,), may limit a pose, given the
            distance between the centres from which on they do not.
    """
    groups: dict[tuple[bool, ...], list[tuple[_Person, Reach]]] = {}
    reserve = basis.policy.rules.start_reserve
    unaware_mps = basis.policy.speed.human_speed_mps(0.0)
    shown = {track.id: track for track in basis.tracks}
    everyone = [(key, memory, None) for key, memory in basis.people.items()]
    for track_id, memory, lost_mps in (*everyone, *_lost(basis, stamp_s, times_s)):
        is_shown = lost_mps is None and shown.get(track_id) is memory.track
        person = _person(
            basis.policy,
            track_id,
            memory,
            stamp_s,
            times_s,
            aware_for_s,
            is_shown,
            basis.prediction,
        )
        reach = _reach(basis.policy, robot, person, unaware_mps)
        free_m = reach.distance_m(robot.max_speed_mps)
        is_aged = person.place_m is not person.track_place_m
        # People move straight on, so that the ends hold all places between them.
        if not is_near(person.place_m[0], person.place_m[-1], free_m) and not (
            is_aged and is_near(person.track_place_m[0], person.track_place_m[-1], free_m)
        ):
            continue
        if lost_mps is not None:
            person = replace(person, lost_mps=lost_mps)
        least_mps = _extreme(np.min, person.human_mps)
        reserved = reserve is not None and (
            least_mps < unaware_mps or math.isfinite(person.start_delay_s)
        )
        counts = basis.policy.rules.protective_field is None and (person.walking_mps > least_mps)
        turns = math.isfinite(person.turn_delay_s)
        key = (
            is_aged,
            counts or turns or (reserved and person.walking_mps > 0.0),
            reserved,
            math.isfinite(person.start_delay_s),
            turns,
            lost_mps is not None,
        )
        groups.setdefault(key, []).append((person, reach))
    # Those who need the most terms come last, when they lower the limit of few poses.
    return [
        _group(group, robot.reaction_time_s, reference_m, *key)
        for key, group in sorted(groups.items(), key=lambda each: sum(each[0]))
    ]


def _group(
    group: list[tuple[_Person, Reach]],
    reaction_s: float,
    reference_m: FloatArray,
    is_aged: bool,
    has_direction: bool,
    reserved: bool,
    stands: bool,
    may_turn: bool,
    is_lost: bool,
) -> PeopleAhead:
    def constant(values: list[float]) -> FloatArray:
        return np.array(values)[:, None]

    people = [person for person, _ in group]
    place_m = np.stack([each.place_m for each in people]) - reference_m
    track_m = np.stack([each.track_place_m for each in people]) - reference_m
    turns_rad = constant([each.turn_rad for each in people])
    turns = has_direction and bool((turns_rad > 0.0).any())
    velocity_mps = np.array([each.velocity_mps for each in people])
    return PeopleAhead(
        track_ids=tuple(each.track_id for each in people),
        x=place_m[:, :, 0],
        y=place_m[:, :, 1],
        track_x=track_m[:, :, 0] if is_aged else None,
        track_y=track_m[:, :, 1] if is_aged else None,
        margin_m=_stacked([each.margin_m for each in people]),
        reaction_s=reaction_s + _stacked([each.age_s for each in people]),
        human_mps=_stacked([each.human_mps for each in people]),
        velocity_x_mps=velocity_mps[:, :1] if has_direction else None,
        velocity_y_mps=velocity_mps[:, 1:] if has_direction else None,
        turn=(np.cos(turns_rad), np.sin(turns_rad)) if turns else None,
        start_delay_s=constant([each.start_delay_s for each in people]) if stands else None,
        turn_delay_s=constant([each.turn_delay_s for each in people]) if may_turn else None,
        velocity_spread_mps=(
            constant([each.velocity_spread_mps for each in people]) if may_turn else None
        ),
        reserved=reserved,
        lost_mps=np.stack([np.asarray(each.lost_mps) for each in people]) if is_lost else None,
        reaches=tuple(reach for _, reach in group),
    )


def _stacked(values: list[float | FloatArray]) -> FloatArray:
    """Return numbers of N people as (N, T), or (N, 1) if all are the same at all times."""
    if all(isinstance(each, float) for each in values):
        return np.array(values)[:, None]
    return np.stack(np.broadcast_arrays(*values))


def _extreme(of: Callable[[FloatArray], Any], values: float | FloatArray) -> float:
    return values if isinstance(values, float) else float(of(values))


def _lost(
    basis: SpeedBasis, stamp_s: float, times_s: FloatArray
) -> list[tuple[int, PersonMemory, FloatArray]]:
    """Return the lost people with the limit (T,) that each of them allows at least."""
    rise_mps2 = basis.policy.timing.lost_rise_mps2
    if rise_mps2 is None:
        return []
    return [
        (
            track_id,
            person.memory,
            (person.limit_mps or 0.0) + rise_mps2 * (stamp_s - person.since_s + times_s),
        )
        for track_id, person in basis.lost.items()
    ]


def _person(
    policy: AwarenessPolicy,
    track_id: int,
    memory: PersonMemory,
    stamp_s: float,
    times_s: FloatArray,
    aware_for_s: float,
    is_shown: bool,
    prediction: PredictionModel | None,
) -> _Person:
    """Return a person at all times; ``is_shown`` says whether their track is in the input."""
    timing, margins, rules = policy.timing, policy.margins, policy.rules
    track, velocity_mps = memory.track, np.array(memory.velocity_odom_mps)
    unaware_mps = policy.speed.human_speed_mps(0.0)
    moved_m = times_s[:, None] * velocity_mps
    place_m = np.array(memory.position_odom_m) + moved_m
    track_m = place_m
    if not is_shown or memory.track_position_odom_m != memory.position_odom_m:
        track_m = np.array(memory.track_position_odom_m) + (moved_m if is_shown else 0.0 * moved_m)
    age_s = max(0.0, stamp_s - track.stamp_s)
    unseen_s = stamp_s - min(memory.seen_stamp_s, track.stamp_s - track.time_since_seen_s)
    is_seen = (
        is_shown and track.status != "coasting" and unseen_s <= timing.fresh_within_s - _SAME_AGE_S
    )
    start_delay_s = memory.start_delay_s if is_seen else math.inf
    human_mps: float | FloatArray = _assumed_mps(policy, memory)
    sigmas: float | FloatArray = margins.uncertainty_sigmas
    sigma_m: float | FloatArray = memory.sigma_m
    ages_s: float | FloatArray = age_s
    if not is_seen:
        # Nobody sees this person again, as far as one can say.
        unseen = unseen_s + times_s > timing.fresh_within_s - _SAME_AGE_S
        sigmas = np.where(unseen, np.maximum(sigmas, margins.unseen_sigmas), sigmas)
        human_mps = np.where(unseen, np.maximum(human_mps, unaware_mps), human_mps)
        if is_shown:
            known_s = track.stamp_s + min(age_s, timing.stop_after_s)
            until_s = known_s + times_s
        else:
            ages_s = age_s + times_s
            until_s = np.minimum(stamp_s + times_s, track.stamp_s + timing.stop_after_s)
        later_m = np.array([position_sigma_m(track, until) for until in until_s.tolist()])
        sigma_m = np.maximum(sigma_m, later_m)
    if prediction is not None:
        ahead_m = predicted_sigmas_m(track, age_s + times_s, prediction)
        sigma_m = np.maximum(sigma_m, ahead_m)
    if aware_for_s < times_s[-1]:
        human_mps = np.where(times_s > aware_for_s, np.maximum(human_mps, unaware_mps), human_mps)
    walking_mps = math.hypot(*memory.velocity_odom_mps)
    turn_delay_s = memory.turn_delay_s if is_seen else math.inf
    if not _may_gain(rules, memory, walking_mps, _extreme(np.max, human_mps)):
        turn_delay_s = math.inf
    turn_rad = 0.0
    if rules.protective_field is None:
        human_mps = _with_excess_mps(human_mps, walking_mps, unaware_mps)
        if walking_mps > BRISK_SHARE * unaware_mps:
            brisk = (walking_mps / max(unaware_mps, 1e-9) - BRISK_SHARE) / (1.0 - BRISK_SHARE)
            turn_rad = math.radians(rules.people_turn_deg) * min(brisk, 1.0)
    return _Person(
        track_id=track_id,
        place_m=place_m,
        track_place_m=track_m,
        margin_m=BODY_RADIUS_M + sigmas * sigma_m,
        age_s=ages_s,
        human_mps=human_mps,
        walking_mps=walking_mps,
        velocity_mps=memory.velocity_odom_mps,
        turn_rad=turn_rad,
        start_delay_s=start_delay_s,
        turn_delay_s=turn_delay_s,
        velocity_spread_mps=memory.velocity_spread_mps,
        lost_mps=None,
    )


def _may_gain(
    rules: SpeedRules, memory: PersonMemory, walking_mps: float, human_mps: float
) -> bool:
    """Return whether the time to turn counts for a person who walks straight away from a pose."""
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


def _assumed_mps(policy: AwarenessPolicy, memory: PersonMemory) -> float:
    """Return the speed that the policy assumes for a person, as the adapter's rules do."""
    if memory.known_s < policy.timing.shrink_after_s - ROUNDING_S:
        return policy.speed.human_speed_mps(0.0)
    return policy.speed.human_speed_mps(1.0 if memory.speed_held else memory.awareness_lower)


def _with_excess_mps(
    assumed_mps: float | FloatArray, walking_mps: float, unaware_mps: float
) -> float | FloatArray:
    """Return the assumed speed of a person who may walk faster than an unaware one."""
    excess_mps = walking_mps - unaware_mps
    if excess_mps <= 0.0:
        return assumed_mps
    running = min(excess_mps / max(RUNNING_SHARE * unaware_mps, 1e-9), 1.0)
    runner_mps = assumed_mps + running * (walking_mps - assumed_mps)
    faster_mps: float | FloatArray = np.maximum(assumed_mps + excess_mps, runner_mps)
    return faster_mps


def _reach(
    policy: AwarenessPolicy, robot: RobotProfile, person: _Person, unaware_mps: float
) -> Reach:
    """Return the distance from which on a person allows the robot a speed."""
    rules, a = policy.rules, robot.max_deceleration_mps2
    human_mps = max(_extreme(np.max, person.human_mps), person.walking_mps, unaware_mps)
    reaction_s = robot.reaction_time_s + _extreme(np.max, person.age_s)
    fixed_m = policy.margins.separation_clearance_m + human_mps * reaction_s
    linear_s = human_mps / a + reaction_s
    if rules.zones is not None:
        span_m = rules.zones.full_speed_beyond_m - rules.zones.stop_within_m
        fixed_m = max(fixed_m, rules.zones.stop_within_m)
        linear_s = max(linear_s, span_m / robot.max_speed_mps)
    if rules.near_cap is not None:
        fixed_m = max(fixed_m, rules.near_cap.within_m)
    body_m = robot.circumscribed_radius_m + _extreme(np.max, person.margin_m)
    return Reach(fixed_m + body_m, linear_s, 0.5 / a)
