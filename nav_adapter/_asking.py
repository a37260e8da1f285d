"""Choice of the person to ask for attention, with a limit on how often, and the answers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from tracking.awareness_filter import PRIOR, estimate
from tracking.people import AVERTED_AWARENESS as _AVERTED
from tracking.people import LOOKING_AWARENESS as _LOOKED
from tracking.people import WALKING_MPS
from tracking.prediction import PredictionModel

from ._alerting import AlertHistory, alerts_due, closest_approach, is_quiet
from ._governor import GovernedSpeed, SpeedGovernor
from ._people import People, Person
from ._places import velocity_variance_m2ps2
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState
from .alerts import Alert, AlertMeans, Answer
from .limit import STANDING_MPS
from .policies import AttentionRules

# Before frames have shown somebody for so long, their speed is hardly known, nor what a look wins.
_KNOWN_S: Final = 1.0 - 1e-9
# An answer takes about so long. Only what it wins from then on counts.
_ANSWER_S: Final = 1.0
# People so near to the one who is asked are asked too.
_GROUP_M: Final = 1.5
# A look lasts about so long, and what is remembered of it comes on top.
_LOOK_S: Final = 1.0
# Neither way is expected to take longer than this.
_LONGEST_S: Final = 10.0
# A robot that has stood for so long is not on its way, and asks nobody.
_PARKED_AFTER_S: Final = 10.0
# Budget, and how long people count as asked.
_MINUTE_S: Final = 60.0


class Asked(NamedTuple):
    """One person who has been asked: how often, when last, and whether they have answered."""

    times: int
    stamp_s: float
    answered: bool = False


@dataclass(frozen=True, slots=True)
class AddressHistory:
    """Warnings and requests of the last minute.

    Attributes:
        warnings: stamps of the latest warnings.
        asked: the people who were asked, by id.
        requests_s: stamps of the requests.
        moved_s: when the robot last moved.
    """

    warnings: AlertHistory = field(default_factory=AlertHistory)
    asked: Mapping[int, Asked] = field(default_factory=dict)
    requests_s: tuple[float, ...] = ()
    moved_s: float = -math.inf


class Addressed(NamedTuple):
    """Alerts and answers of one update, and the history with them."""

    alerts: tuple[Alert, ...]
    answers: tuple[Answer, ...]
    history: AddressHistory


class Addressing:
    """Warns people of collisions, and asks for attention.

    A request or a warning changes no obstacle and no limit: only a look does, once measured.

    Args:
        policy: rules of warnings and requests.
        robot: profile of the robot.
        people: gives the reach of each person.
        governor: gives the limits with and without a look.
        prediction: of warnings.
    """

    def __init__(
        self,
        policy: AwarenessPolicy,
        robot: RobotProfile,
        people: People,
        governor: SpeedGovernor,
        prediction: PredictionModel | None,
    ) -> None:
        self._policy, self._robot = policy, robot
        self._people, self._governor, self._prediction = people, governor, prediction
        # A look, and what it leaves behind.
        counts_as, self._lasts_s = policy.noticed_counts_as, _LOOK_S
        self._looked_lower = 1.0 if counts_as is None else counts_as
        if counts_as is not None:
            self._lasts_s += policy.filter.noticed_memory_s
        nothing_known = estimate(PRIOR)
        self._unseen_std = 0.5 * float(nothing_known.awareness_std)

    def answered(self, history: AddressHistory, now: float) -> frozenset[int]:
        """Return the people whose answer may still be remembered."""
        rules = self._policy.attention
        if rules is None:
            return frozenset()
        lasts_s = rules.pause_s + self._lasts_s
        return frozenset(
            track_id
            for track_id, each in history.asked.items()
            if each.answered and now - each.stamp_s <= lasts_s
        )

    def step(
        self,
        history: AddressHistory,
        people: Mapping[int, Person],
        limit: GovernedSpeed,
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> Addressed:
        """Return the warnings of an update, then the request, and the answers."""
        alerts: tuple[Alert, ...] = ()
        warnings = history.warnings
        if self._policy.alerts is not None:
            alerts, warnings = alerts_due(
                self._policy.alerts,
                self._robot,
                people,
                robot_state,
                now,
                self._policy.margins.uncertainty_sigmas,
                warnings,
                self._prediction,
            )
        rules = self._policy.attention
        if rules is None:
            return Addressed(alerts, (), replace(history, warnings=warnings))
        answers, asked = _answers(history.asked, people, rules, now)
        moves = robot_state.travel_mps > STANDING_MPS
        history = AddressHistory(
            warnings,
            asked,
            tuple(stamp_s for stamp_s in history.requests_s if now - stamp_s < _MINUTE_S),
            now if moves else history.moved_s,
        )
        person = self._to_ask(rules, history, people, limit, robot_state, now)
        if person is None or any(alert.track_id == person.track.id for alert in alerts):
            return Addressed(alerts, answers, history)
        means = _means(rules, history, person, now)
        group = _group(person, people)
        wins_s = 0.0
        if means is not None:
            wins_s = self._wins_s(person, group, people, robot_state, now, robot_age_s)
        if means is None or wins_s < rules.min_gain_s or wins_s <= 0.0:
            return Addressed(alerts, answers, history)
        request = self._request(person, means, wins_s, limit.limit_mps, robot_state, now)
        for track_id in group:
            before = asked.get(track_id, Asked(0, now))
            if not before.answered:
                asked[track_id] = Asked(before.times + 1, now)
        history = replace(history, requests_s=(*history.requests_s, now))
        return Addressed((*alerts, request), answers, history)

    def _to_ask(
        self,
        rules: AttentionRules,
        history: AddressHistory,
        people: Mapping[int, Person],
        limit: GovernedSpeed,
        robot_state: RobotState,
        now: float,
    ) -> Person | None:
        """Return the person who sets the limit, if they may be asked now."""
        person = None if limit.track_id is None else people.get(limit.track_id)
        if person is None or person.awareness_lower >= _LOOKED or person.known_s < _KNOWN_S:
            return None
        # Nobody would see the answer of somebody out of sight, or whose face no camera can see:
        # what is known of their α is then hardly more than of anybody's.
        unseen = now - person.seen_stamp_s > self._policy.timing.fresh_within_s
        unseen |= person.track.awareness_std > self._unseen_std
        parked = now - history.moved_s > _PARKED_AFTER_S
        distance_m = math.dist(person.position_odom_m, robot_state.position_odom_m)
        if unseen or parked or person.track.status == "tentative" or distance_m > rules.within_m:
            return None
        before = history.asked.get(person.track.id)
        waits = before is not None and (
            before.answered or now - before.stamp_s < _pause_s(rules, before)
        )
        return None if waits or len(history.requests_s) >= rules.per_minute else person

    def _wins_s(
        self,
        person: Person,
        group: frozenset[int],
        people: Mapping[int, Person],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> float:
        """Return the time that a look of the group would win on the way past the person.

        That is at the limits a second from now, if robot and people go straight on until then.
        """
        x, y = robot_state.position_odom_m.tolist()
        vx, vy = robot_state.velocity_odom_mps
        later = replace(
            robot_state, position_odom_m=np.array([x + _ANSWER_S * vx, y + _ANSWER_S * vy])
        )
        straight, courses = self._governor.courses(later, robot_age_s)
        vx, vy = person.velocity_odom_mps
        along_mps = straight.cos * vx + straight.sin * vy
        # Beside somebody who walks the same way, a look is forgotten before the robot has passed.
        if along_mps + math.sqrt(velocity_variance_m2ps2(person.track)) >= WALKING_MPS:
            return 0.0
        others_mps, now_mps, then_mps = self._robot.max_speed_mps, math.inf, math.inf
        for track_id, each in people.items():
            moved = _moved(each, _ANSWER_S)
            # A limit that others undercut counts for nothing.
            counts_mps = min(others_mps, now_mps)
            if track_id not in group:
                counts_mps = others_mps
            own_mps, _ = self._governor.person_mps(moved, straight, courses, now, counts_mps)
            if track_id not in group:
                others_mps = min(others_mps, own_mps)
                continue
            lower = max(each.awareness_lower, self._looked_lower)
            aware = moved._replace(awareness_lower=lower)
            counts_mps = min(others_mps, then_mps)
            aware_mps, _ = self._governor.person_mps(aware, straight, courses, now, counts_mps)
            now_mps, then_mps = min(now_mps, own_mps), min(then_mps, aware_mps)
        now_mps, then_mps = min(now_mps, others_mps), min(then_mps, others_mps)
        x, y = _moved(person, _ANSWER_S).position_odom_m
        way_m = straight.cos * (x - straight.x_m) + straight.sin * (y - straight.y_m)
        way_m += BODY_RADIUS_M - straight.rear_m
        passing_s = _time_s(way_m, then_mps - along_mps)
        if passing_s > self._lasts_s:
            return 0.0  # the look would be forgotten: ask later
        return _time_s(way_m, now_mps - along_mps) - passing_s

    def _request(
        self,
        person: Person,
        means: AlertMeans,
        wins_s: float,
        limit_mps: float,
        robot_state: RobotState,
        now: float,
    ) -> Alert:
        track_id = person.track.id
        time_s, gap_m = closest_approach(
            person,
            robot_state.position_odom_m.tolist(),
            robot_state.velocity_odom_mps,
            now - robot_state.stamp_s,
            self._robot.circumscribed_radius_m + BODY_RADIUS_M,
        )
        return Alert(
            track_id,
            "attention",
            time_s if math.isfinite(time_s) else 0.0,
            gap_m,
            f"track {track_id}: limits the robot to {limit_mps:.1f} m/s, has not looked",
            means,
            wins_s,
        )


def _answers(
    asked: Mapping[int, Asked],
    people: Mapping[int, Person],
    rules: AttentionRules,
    now: float,
) -> tuple[tuple[Answer, ...], dict[int, Asked]]:
    """Return the answers since the last update, and the people who were asked in this minute."""
    answers, kept = [], {}
    for track_id, each in asked.items():
        if now - each.stamp_s >= max(_MINUTE_S, _pause_s(rules, each)):
            continue
        person = people.get(track_id)
        if person is not None and person.is_at_first_sight:
            continue  # the id belongs to somebody else now
        kept[track_id] = each
        if person is None or each.answered or person.awareness_lower < _LOOKED:
            continue
        after_s = person.seen_stamp_s - each.stamp_s
        if 0.0 < after_s <= rules.pause_s:
            answers.append(Answer(track_id, after_s))
            kept[track_id] = each._replace(answered=True)
    return tuple(answers), kept


def _pause_s(rules: AttentionRules, asked: Asked) -> float:
    """Return the pause after the last request: twice as long after each without an answer."""
    return rules.pause_s * 2.0 ** (asked.times - 1)


def _means(
    rules: AttentionRules,
    history: AddressHistory,
    person: Person,
    now: float,
) -> AlertMeans | None:
    """Return the quietest means that can reach a person, the next louder for each request before.

    None if there is none now: warnings sound first.
    """
    usable: tuple[AlertMeans, ...] = rules.means
    if person.track.awareness <= _AVERTED:
        usable = tuple(each for each in usable if each != "light")
    if not usable:
        return None
    before = history.asked.get(person.track.id)
    means = usable[min(0 if before is None else before.times, len(usable) - 1)]
    return None if means == "voice" and not is_quiet(history.warnings, now) else means


def _group(person: Person, people: Mapping[int, Person]) -> frozenset[int]:
    """Return the ids of all who are asked with a person: those beside them who have not looked."""
    return frozenset(
        track_id
        for track_id, each in people.items()
        if track_id == person.track.id
        or (
            each.awareness_lower < _LOOKED
            and math.dist(each.position_odom_m, person.position_odom_m) <= _GROUP_M
        )
    )


def _moved(person: Person, ahead_s: float) -> Person:
    """Return a person who has walked straight on for so long."""
    vx, vy = person.velocity_odom_mps
    (x, y), (track_x, track_y) = person.position_odom_m, person.track_position_odom_m
    return person._replace(
        position_odom_m=(x + ahead_s * vx, y + ahead_s * vy),
        track_position_odom_m=(track_x + ahead_s * vx, track_y + ahead_s * vy),
    )


def _time_s(way_m: float, speed_mps: float) -> float:
    """Return the time for a way, 10 s at most; 0 for one that lies behind."""
    if way_m <= 0.0:
        return 0.0
    return min(way_m / speed_mps, _LONGEST_S) if speed_mps > 0.0 else _LONGEST_S
