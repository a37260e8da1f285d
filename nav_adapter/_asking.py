"""Choice of the people to warn and of the one to ask for attention, and the answers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack
from tracking.awareness_filter import PRIOR, estimate
from tracking.people import AVERTED_AWARENESS as _AVERTED
from tracking.people import LOOKING_AWARENESS as _LOOKED
from tracking.prediction import PredictionModel

from ._governor import GovernedSpeed, SpeedGovernor
from ._people import Asked, Person, Vector2
from ._policy import AwarenessPolicy
from ._predicted import predicted_sigmas_m
from ._robot import RobotProfile, RobotState
from .alerts import Alert, AlertKind, AlertMeans, Answer
from .limit import STANDING_MPS
from .policies import AlertRules, AttentionRules

# Below this relative speed there is no closest approach.
_SAME_VELOCITY_MPS: Final = 1e-3
# Below this value of −(r · v), whether they approach is a matter of rounding.
_CLOSING_M2PS: Final = 1e-9
# The prediction is known to hold so far ahead.
_PREDICTED_S: Final = 2.0
# The lower bound of α below which a person is warned.
_UNAWARE_BELOW: Final = 0.3
# Shortest time until the same person gets the same alert again, and between a sound and another
# that is no louder.
_REPEAT_AFTER_S: Final = 3.0
_QUIET_S: Final = 1.0
_LOUDNESS: Final[dict[AlertKind, int]] = {"voice": 1, "horn": 2}
# A look sooner after a request is by chance. The eyes need about 0.2 s to set out for a new target
# (Saslow, Latency for saccadic eye movement, J. Opt. Soc. Am. 57, 1967), and the head follows.
_REACTION_S: Final = 0.3 - 1e-9
# Before frames have shown somebody for so long, their speed is hardly known, nor what a look wins.
_KNOWN_S: Final = 1.0 - 1e-9
# An answer takes about so long. Only what it wins from then on counts.
_ANSWER_S: Final = 1.0
# People so near to the one who is asked are asked too.
_GROUP_M: Final = 1.5
# A look lasts about so long, and what is remembered of it comes on top.
_LOOK_S: Final = 1.0
# No way past somebody is expected to take longer than this; it is driven in steps.
_LONGEST_S: Final = 10.0
_STEP_S: Final = 0.5
# So long after a look that would have won too little, it is not computed again: with many people it
# takes ten times as long as the limit.
_WEIGHED_S: Final = 0.5
# A robot that has stood for so long is not on its way, and asks nobody.
_PARKED_AFTER_S: Final = 10.0
# Budget, and how long people count as asked.
_MINUTE_S: Final = 60.0


class Sound(NamedTuple):
    """The latest warning that sounded: its stamp, and how loud it was."""

    stamp_s: float = -math.inf
    loudness: int = 0

    def holds_back(self, kind: AlertKind, now: float) -> bool:
        """Return whether an alert of this kind has to wait, so that people can tell the two."""
        return now - self.stamp_s < _QUIET_S and 0 < _LOUDNESS.get(kind, 0) <= self.loudness


class AddressHistory(NamedTuple):
    """The latest warning that sounded, the requests of the last minute, and the latest motion.

    And when a look was last found to win too little.
    """

    sound: Sound = Sound()
    requests_s: tuple[float, ...] = ()
    moved_s: float = -math.inf
    weighed_s: float = -math.inf


class Addressed(NamedTuple):
    """Alerts and answers of one update, the history with them, and the people, who remember."""

    alerts: tuple[Alert, ...]
    answers: tuple[Answer, ...]
    history: AddressHistory
    people: dict[int, Person]


class Addressing:
    """Warns people of collisions, and asks for attention.

    A request or a warning changes no obstacle and no limit: only a look does, once measured. The
    governor gives the limits with and without a look; the prediction is of warnings.
    """

    def __init__(
        self,
        policy: AwarenessPolicy,
        robot: RobotProfile,
        governor: SpeedGovernor,
        prediction: PredictionModel | None,
    ) -> None:
        self._policy, self._robot = policy, robot
        self._governor, self._prediction = governor, prediction
        # A look, and what it leaves behind.
        counts_as, self._lasts_s = policy.noticed_counts_as, _LOOK_S
        self._looked_lower = 1.0 if counts_as is None else counts_as
        if counts_as is not None:
            self._lasts_s += policy.filter.noticed_memory_s
        self._unseen_std = 0.5 * float(estimate(PRIOR).awareness_std)

    def step(
        self,
        history: AddressHistory,
        people: dict[int, Person],
        limit: GovernedSpeed,
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> Addressed:
        """Return the warnings of an update, then the request, and the answers."""
        people, sound = dict(people), history.sound
        moved_s, weighed_s = history.moved_s, history.weighed_s
        alerts: list[Alert] = []
        if self._policy.alerts is not None:
            alerts, sound = self._warnings(self._policy.alerts, people, robot_state, now, sound)
        rules = self._policy.attention
        if rules is None:
            return Addressed(tuple(alerts), (), AddressHistory(sound), people)
        answers = tuple(_answers(people, rules, now))
        if robot_state.travel_mps > STANDING_MPS:
            moved_s = now
        recent_s = tuple(each for each in history.requests_s if now - each < _MINUTE_S)
        person = None if limit.track_id is None else people.get(limit.track_id)
        means = None
        if (
            person is not None
            and len(recent_s) < rules.per_minute
            and now - moved_s <= _PARKED_AFTER_S
            and now - weighed_s >= _WEIGHED_S
            and not any(alert.track_id == person.id for alert in alerts)
            and self._may_be_asked(person, rules, robot_state, now)
        ):
            means = _means(rules, person, sound, now)
        if person is not None and means is not None:
            group = _group(person, people.values())
            wins_s = self._wins_s(person, group, people, robot_state, now, robot_age_s)
            if wins_s >= rules.min_gain_s and wins_s > 0.0:
                alerts.append(self._request(person, means, wins_s, limit, robot_state, now))
                recent_s = *recent_s, now
                for each in group:
                    before = each.asked or Asked(0, now)
                    if not before.answered:
                        asked = Asked(before.times + 1, now)
                        people[each.id] = each._replace(asked=asked)
            else:
                weighed_s = now
        history = AddressHistory(sound, recent_s, moved_s, weighed_s)
        return Addressed(tuple(alerts), answers, history, people)

    def _warnings(
        self,
        rules: AlertRules,
        people: dict[int, Person],
        robot_state: RobotState,
        now: float,
        sound: Sound,
    ) -> tuple[list[Alert], Sound]:
        """Return the warnings to give now, the most urgent first, and the latest sound with them.

        Tentative tracks may be clutter and are not warned. Robot and people are predicted with
        their present velocities, the robot straight ahead. The robot counts as its circumscribed
        circle, and a body is enlarged by standard deviations of its position: the present one, or
        with a prediction the one at the closest approach, at most 2 s ahead. Of ``people``, those
        who are warned are replaced.
        """
        candidates: list[Alert] = []
        sigmas = self._policy.margins.uncertainty_sigmas
        # The robot's state is ``age_s`` old; it has driven straight on since.
        age_s, position = now - robot_state.stamp_s, robot_state.position_odom_m.tolist()
        reach_m = self._robot.circumscribed_radius_m + BODY_RADIUS_M
        for each in people.values() if robot_state.travel_mps > STANDING_MPS else ():
            if each.track.status == "tentative" or each.awareness_lower >= _UNAWARE_BELOW:
                continue
            time_s, gap_m = _closest_approach(
                *(each, position, robot_state.velocity_odom_mps, age_s),
                reach_m + sigmas * each.sigma_m,
            )
            if self._prediction is not None and math.isfinite(time_s):
                horizon_s = np.array(
                    [max(now - each.track.stamp_s, 0.0) + min(time_s, _PREDICTED_S)]
                )
                sigma_m = float(predicted_sigmas_m(each.track, horizon_s, self._prediction)[0])
                gap_m = max(gap_m - sigmas * max(0.0, sigma_m - each.sigma_m), 0.0)
            kind = _kind(rules, time_s) if gap_m <= rules.miss_within_m else None
            if kind is not None:
                reason = (
                    f"track {each.id}: unaware (lower bound {each.awareness_lower:.2f}), "
                    f"closest approach of {gap_m:.1f} m in {time_s:.1f} s"
                )
                candidates.append(Alert(each.id, kind, time_s, gap_m, reason))
        candidates.sort(key=lambda alert: (alert.time_to_closest_s, alert.track_id))
        alerts = []
        for alert in candidates:
            person = people[alert.track_id]
            warned_s = dict(person.warned_s)
            repeats = now - warned_s.get(alert.kind, -math.inf) < _REPEAT_AFTER_S
            if repeats or sound.holds_back(alert.kind, now):
                continue
            if alert.kind in _LOUDNESS:
                sound = Sound(now, _LOUDNESS[alert.kind])
            warned_s[alert.kind] = now
            people[person.id] = person._replace(warned_s=tuple(warned_s.items()))
            alerts.append(alert)
        return alerts, sound

    def _may_be_asked(
        self, person: Person, rules: AttentionRules, robot_state: RobotState, now: float
    ) -> bool:
        """Return whether a person may be asked now who sets the limit."""
        asked, track = person.asked, person.track
        return (
            person.awareness_lower < _LOOKED
            and person.known_s >= _KNOWN_S
            and track.status != "tentative"
            and (
                asked is None
                or not (asked.answered or now - asked.stamp_s < _pause_s(rules, asked))
            )
            # Nobody would see the answer of somebody out of sight, or whose face no camera can see:
            # what is known of their α is then hardly more than of anybody's.
            and now - person.seen_stamp_s <= self._policy.timing.fresh_within_s
            and track.awareness_std <= self._unseen_std
            and math.dist(person.position_odom_m, robot_state.position_odom_m) <= rules.within_m
        )

    def _wins_s(
        self,
        person: Person,
        group: list[Person],
        people: dict[int, Person],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> float:
        """Return the time that a look of the group would win on the way past the person.

        It is the time behind the limit until the robot has passed them if nobody looks, less the
        same if the group looks for as long as a look counts. Both begin a second from now. Robot
        and people go straight on, and no way takes more than 10 s: so long waits a robot that
        stands for somebody who stands for it, and so long it follows somebody who walks ahead.
        """
        ids, (vx, vy) = {each.id for each in group}, person.velocity_odom_mps

        def passing_s(looking_s: float) -> float:
            here = robot_state.position_odom_m + _ANSWER_S * np.array(robot_state.velocity_odom_mps)
            for step in range(round(_LONGEST_S / _STEP_S)):
                at_s, limit_mps = step * _STEP_S, self._robot.max_speed_mps
                state = replace(robot_state, position_odom_m=here)
                courses = self._governor.courses(state, robot_age_s)
                left_s = looking_s - at_s
                for each in people.values():
                    then = _moved(each, _ANSWER_S + at_s)
                    if each.id in ids and left_s > 0.0:
                        then = then._replace(
                            awareness_lower=max(each.awareness_lower, self._looked_lower),
                            aware_for_s=max(each.aware_for_s, left_s),
                        )
                    own_mps = self._governor.person_mps(then, courses, now, limit_mps)
                    limit_mps = min(limit_mps, own_mps)
                course, (x, y) = courses.turned, _moved(person, _ANSWER_S + at_s).position_odom_m
                way_m: float = course.cos * (x - course.x_m) + course.sin * (y - course.y_m)
                way_m += BODY_RADIUS_M - course.rear_m
                if way_m <= 0.0:
                    return at_s
                passes_mps: float = limit_mps - course.cos * vx - course.sin * vy
                if way_m <= passes_mps * _STEP_S:
                    return at_s + way_m / passes_mps
                here = here + _STEP_S * limit_mps * np.array([course.cos, course.sin])
            return _LONGEST_S

        return passing_s(0.0) - passing_s(self._lasts_s)

    def _request(
        self,
        person: Person,
        means: AlertMeans,
        wins_s: float,
        limit: GovernedSpeed,
        robot_state: RobotState,
        now: float,
    ) -> Alert:
        time_s, gap_m = _closest_approach(
            person,
            robot_state.position_odom_m.tolist(),
            robot_state.velocity_odom_mps,
            now - robot_state.stamp_s,
            self._robot.circumscribed_radius_m + BODY_RADIUS_M,
        )
        return Alert(
            person.id,
            "attention",
            time_s if math.isfinite(time_s) else 0.0,
            gap_m,
            f"track {person.id}: limits the robot to {limit.limit_mps:.1f} m/s, has not looked",
            means,
            wins_s,
        )


def _answers(people: dict[int, Person], rules: AttentionRules, now: float) -> Iterable[Answer]:
    """Yield the answers since the last update; the people remember them, and forget old requests.

    An answer is a look of which the camera made the picture after the request, and no sooner than
    anybody could react. Scans show nobody's look.
    """
    for person in people.values():
        asked = person.asked
        if asked is None:
            continue
        after_s = _pictured_s(person.track) - asked.stamp_s
        if now - asked.stamp_s >= max(_MINUTE_S, _pause_s(rules, asked)):
            asked = None
        elif (
            not asked.answered
            and person.awareness_lower >= _LOOKED
            and _REACTION_S <= after_s <= rules.pause_s
        ):
            yield Answer(person.id, after_s)
            asked = asked._replace(answered=True)
        people[person.id] = person._replace(asked=asked)


def _pictured_s(track: PersonTrack) -> float:
    """Return the stamp of the latest picture of a person's face; the latest frame's, if unknown."""
    since_s = track.time_since_face_s
    return track.stamp_s - (track.time_since_seen_s if since_s is None else since_s)


def _pause_s(rules: AttentionRules, asked: Asked) -> float:
    """Return the pause after the last request: twice as long after each without an answer."""
    return rules.pause_s * 2.0 ** (asked.times - 1)


def _means(rules: AttentionRules, person: Person, sound: Sound, now: float) -> AlertMeans | None:
    """Return the quietest means that can reach a person, the next louder for each request before.

    None if there is none now: warnings sound first.
    """
    averted = person.track.awareness <= _AVERTED
    usable = [each for each in rules.means if not (averted and each == "light")]
    if not usable:
        return None
    means = usable[min(0 if person.asked is None else person.asked.times, len(usable) - 1)]
    return None if sound.holds_back(means, now) else means


def _group(person: Person, people: Iterable[Person]) -> list[Person]:
    """Return all who are asked with a person: those beside them who have not looked."""
    return [
        each
        for each in people
        if each.id == person.id
        or (
            each.awareness_lower < _LOOKED
            and math.dist(each.position_odom_m, person.position_odom_m) <= _GROUP_M
        )
    ]


def _moved(person: Person, ahead_s: float) -> Person:
    """Return a person who has walked straight on for so long."""
    vx, vy = person.velocity_odom_mps
    (x, y), (track_x, track_y) = person.position_odom_m, person.track_position_odom_m
    return person._replace(
        position_odom_m=(x + ahead_s * vx, y + ahead_s * vy),
        track_position_odom_m=(track_x + ahead_s * vx, track_y + ahead_s * vy),
    )


def _kind(rules: AlertRules, time_s: float) -> AlertKind | None:
    """Return the loudest alert whose time is reached."""
    if time_s < rules.horn_within_s:
        return "horn"
    if time_s < rules.voice_within_s:
        return "voice"
    return "light" if time_s < rules.light_within_s else None


def _closest_approach(
    memory: Person, robot_m: Vector2, robot_mps: Vector2, age_s: float, reach_m: float
) -> tuple[float, float]:
    """Return time (s) and gap (m) of the closest approach; the time is infinite if they move apart.

    The robot was at ``robot_m`` ``age_s`` ago.
    """
    (x, y), (vx, vy) = memory.position_odom_m, memory.velocity_odom_mps
    x, y = x - robot_m[0] - age_s * robot_mps[0], y - robot_m[1] - age_s * robot_mps[1]
    vx, vy = vx - robot_mps[0], vy - robot_mps[1]
    speed2 = vx * vx + vy * vy
    closing = -(x * vx + y * vy)
    if speed2 < _SAME_VELOCITY_MPS**2 or closing <= _CLOSING_M2PS:
        return math.inf, max(math.hypot(x, y) - reach_m, 0.0)
    time_s = closing / speed2
    return time_s, max(math.hypot(x + time_s * vx, y + time_s * vy) - reach_m, 0.0)
