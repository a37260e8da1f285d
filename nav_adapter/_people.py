"""The people that the adapter remembers from one update to the next, and how far it trusts α."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Final, NamedTuple

import numpy as np

from perception.arrays import finite_number
from tracking import PersonTrack
from tracking.people import AVERTED_LEFT_S

from ._errors import NavError
from ._places import checked_sigma_m, position_sigma_m
from ._policy import AwarenessPolicy
from ._robot import RobotProfile
from .alerts import AlertKind
from .limit import passing_radius_m

Vector2 = tuple[float, float]

# Awareness raises no speed before frames have shown a person for this long.
_FIRST_SIGHT_S: Final = 0.2
# The belief in having noticed the robot from which it counts.
_NOTICED: Final = 0.5
# Walking speed of ISO 13855: the way that explains a new place, at least.
_WALKER_MPS: Final = 1.6
# Standard deviations by which two positions of one person may differ. 4 are exceeded once in
# 3000 frames, which costs a moment of speed.
_EXPLAINED_SIGMAS: Final = 4.0
# Places closer than this are the same, also for a tracker that reports no uncertainty.
_SAME_PLACE_M: Final = 0.05
# Stamps closer than this are equal: the stamp of a sighting is a difference of floats, computed
# anew for every frame.
_SAME_STAMP_S: Final = 1e-6
# Tolerance for rounding where sums of frame periods are compared with a setting.
_ROUNDING_S: Final = 1e-9
# People whose id now belongs to another are known by ids below this, that of the bridge's stop
# polygon.
_STOP_POLYGON_ID: Final = -1


class Asked(NamedTuple):
    """The requests to one person: how many, when the last was, and whether they have answered."""

    times: int
    stamp_s: float
    answered: bool = False


class Person(NamedTuple):
    """One person as of the adapter's last update: an identity of the adapter's own.

    Each update hands a person on to the next, with all that is remembered of them; the id of a
    track is only what outputs call them. Values of the track that every rule needs are kept as
    floats, since reading them from their arrays again and again would take longer than the rules.

    Attributes:
        id: of the latest track, or a negative one if that id now belongs to somebody else.
        track: the latest track of this person.
        track_position_odom_m: position of the track, at its own stamp.
        position_odom_m: position predicted to the update.
        velocity_odom_mps: velocity of the track.
        seen_stamp_s: stamp of the latest frame that showed the person.
        awareness_lower: the lower bound of α that was used.
        aware_for_s: for how long that holds from the stamp of the track on, if they keep to their
            motion and do not look away.
        departed_mps: speed by which they depart from it.
        radius_m: radius of the obstacle.
        sigma_m: standard deviation of the position along its most uncertain direction.
        known_s: time for which frames have shown the person.
        was_confirmed: whether the track has ever been more than tentative.
        lost_since_s: when a person who was dropped ceased to count in full; None for one who has
            not been dropped.
        lost_limit_mps: the limit that they set then, once it is known.
        asked: the requests to look at the robot, or None.
        warned_s: each kind of warning that they have had, with the stamp of the latest.
    """

    id: int
    track: PersonTrack
    track_position_odom_m: Vector2
    position_odom_m: Vector2
    velocity_odom_mps: Vector2
    seen_stamp_s: float
    awareness_lower: float
    aware_for_s: float
    departed_mps: float
    radius_m: float
    sigma_m: float
    known_s: float
    was_confirmed: bool
    lost_since_s: float | None = None
    lost_limit_mps: float | None = None
    asked: Asked | None = None
    warned_s: tuple[tuple[AlertKind, float], ...] = ()

    def counts_for_s(self, ahead_s: float = 0.0) -> float:
        """Return for how long awareness counts in a limit at ``ahead_s`` from the track's stamp on.

        They may look away at any moment. Infinite where nothing is remembered.
        """
        left_s = max(self.aware_for_s - ahead_s, 0.0)
        return left_s if left_s == math.inf else min(left_s, AVERTED_LEFT_S)

    @property
    def is_at_first_sight(self) -> bool:
        """True until frames have shown this person long enough for awareness to raise a speed."""
        return self.known_s < _FIRST_SIGHT_S - _ROUNDING_S

    @property
    def is_lost(self) -> bool:
        """True for a person who has been dropped and still limits the speed."""
        return self.lost_since_s is not None

    def lost_for_s(self, stamp_s: float) -> float:
        """Return for how long a person has been lost; 0 for one who has not been dropped."""
        return 0.0 if self.lost_since_s is None else stamp_s - self.lost_since_s

    def is_repeated_by(self, track: PersonTrack) -> bool:
        """Return whether a track rests on no newer frame: it is no new evidence then."""
        return _seen_stamp_s(track) - self.seen_stamp_s <= _SAME_STAMP_S

    def may_be(self, track: PersonTrack, walking_mps: float) -> bool:
        """Return whether a track is where this person can be.

        The place is explained by that of their own track, or by its prediction with constant
        velocity, within the covariances of both and the way walked at ``walking_mps``. Somebody who
        is lost may have walked since a frame showed them.
        """
        elapsed_s = max(track.stamp_s - self.track.stamp_s, 0.0)
        walked_s = max(track.stamp_s - self.seen_stamp_s, 0.0) if self.is_lost else elapsed_s
        x, y = track.position_odom_m.tolist()
        (old_x, old_y), (vx, vy) = self.track_position_odom_m, self.velocity_odom_mps
        way_m = walking_mps * walked_s + _SAME_PLACE_M
        apart_m = math.hypot(x - old_x, y - old_y)
        if apart_m <= way_m:
            return True
        apart_m = min(apart_m, math.hypot(x - old_x - elapsed_s * vx, y - old_y - elapsed_s * vy))
        sigma_m = math.hypot(position_sigma_m(self.track, elapsed_s), position_sigma_m(track, 0.0))
        return apart_m <= way_m + _EXPLAINED_SIGMAS * sigma_m


_NOTHING_KEPT: Final[
    tuple[float | None, float | None, Asked | None, tuple[tuple[AlertKind, float], ...]]
] = (None, None, None, ())


class People:
    """Rules by which people are followed, trusted and sized. The caller keeps the people.

    Obstacles grow at once. They shrink at a bounded rate, only in time in which frames showed a
    confirmed person. While no frame does, neither repeated nor predicted tracks shrink an obstacle
    or raise awareness.

    Awareness raises no speed until frames have shown a person for 0.2 s. A known id at a place that
    the person could not have reached belongs to a new, unaware person. The person who had it is
    kept under a negative id, as they would be without a track.

    The robot decides how large a circle must be for the limit beside it.

    Raises:
        NavError: for a custom policy object whose values are not finite or grow with awareness.
    """

    def __init__(self, policy: AwarenessPolicy, robot: RobotProfile) -> None:
        self._policy, self._timing, self._margins = policy, policy.timing, policy.margins
        margins = policy.margins
        inflation, speed = policy.inflation, policy.speed
        self._radius_of = inflation.radius_m
        _require_non_increasing(self._policy_speed_mps, type(speed).__name__, "m/s")
        self._unaware_mps = self._policy_speed_mps(0.0)
        # People walk even where their speed does not count.
        self._jump_mps = max(self._unaware_mps, _WALKER_MPS)
        # A circle that is too small leads a planner to where the robot may hardly move.
        speeds = np.linspace(self._policy_speed_mps(1.0), self._unaware_mps, 5).tolist()
        self._passing_speeds: list[float] = sorted(set(speeds))
        reach = policy.reach if policy.applies("reach") else None
        self._passing_radii = [
            passing_radius_m(each, reach, margins.clearance_m, robot, within_m)
            for each in self._passing_speeds
            for within_m in [margins.within_m(each, self._unaware_mps)]
        ]
        _require_non_increasing(self._policy_radius_m, type(inflation).__name__, "m")
        self._unaware_m = self._policy_radius_m(0.0)

    def follow(
        self,
        people: Iterable[Person],
        tracks: Iterable[PersonTrack],
        now: float,
        before_s: float | None,
        *,
        stale: bool,
        silent: bool,
    ) -> list[Person]:
        """Return everybody as of ``now``, in the order of their ids: present, missing and lost.

        A track goes on with the person of its id, if they can be there. A track that is new, or
        whose own person cannot be there, goes on with somebody who has lost their id, if they can
        be there: at first sight again, but not forgotten. Each track stands for one person, and
        clutter for nobody.

        The ``people`` are those of the update ``before_s``. Data are ``stale`` if they are too old
        to trust, and ``silent`` says that there was a pause in the updates.

        Raises:
            NavError: for finite numbers that are too large for any person.
        """
        if silent:
            people = [self._after_silence(person) for person in people]
        left = {person.id: person for person in people}
        lowest_id = min((_STOP_POLYGON_ID, *left))
        followed, robbed = [], []
        strangers: dict[int, PersonTrack] = {}
        for track in sorted(tracks, key=lambda track: track.id):
            person = left.pop(track.id, None)
            if person is not None and person.may_be(track, self._jump_mps):
                followed.append(self._shown(track, person, now, stale))
                continue
            strangers[track.id] = track
            if person is not None:
                robbed.append(person)
        heirs = self._heirs(robbed, strangers.values())
        exchanged = {person.id for person in robbed}
        for track_id, track in strangers.items():
            had = heirs.pop(track_id, None)
            lower = self._trusted_lower(track, None, now, stale or track_id in exchanged)
            followed.append(_remembering(self._at(track, None, lower, now), had))
            if had is not None:
                robbed.remove(had)
        for person in robbed:
            lowest_id -= 1
            left[lowest_id] = person._replace(id=lowest_id)
        for person in left.values():
            kept = self._without_track(person, now, before_s)
            if kept is not None:
                followed.append(kept)
        return sorted(followed, key=lambda person: person.id)

    def _heirs(
        self, robbed: Iterable[Person], strangers: Iterable[PersonTrack]
    ) -> dict[int, Person]:
        """Return the people who go on under another id, by that id, the nearest first."""
        pairs = [
            (math.dist(person.track_position_odom_m, track.position_odom_m), track.id, person)
            for person in robbed
            for track in strangers
            if not person.is_lost
            and track.status != "tentative"
            and person.may_be(track, self._jump_mps)
        ]
        heirs: dict[int, Person] = {}
        for _, track_id, person in sorted(pairs, key=lambda pair: pair[0]):
            if track_id not in heirs and person not in heirs.values():
                heirs[track_id] = person
        return heirs

    def _without_track(self, person: Person, now: float, before_s: float | None) -> Person | None:
        """Return a person without a track in the input: missing at first, then lost, then None.

        They are unaware and walk on. The tracker of this project reports a coasting person before
        it deletes the track. Another tracker may delete a track as soon as a detection fails, which
        is when the person is most likely hidden and still there. A tracker gives somebody up when
        they have been out of sight for long, which is when least is known of them. So all are kept
        but for a track that was never more than tentative, which may be clutter, and for somebody
        whose place a sensor has shown empty (:attr:`~tracking.PersonTrack.place_empty`).
        """
        hold_s = self._timing.hold_s
        if not person.is_lost and not (
            person.was_confirmed and now - person.seen_stamp_s <= hold_s
        ):
            gone = not person.was_confirmed or person.track.place_empty
            if gone or self._timing.lost_rise_mps2 is None or before_s is None:
                return None
            # After a pause in the updates they have been lost for some time.
            since_s = min(max(person.seen_stamp_s + hold_s, before_s), now)
            person = person._replace(lost_since_s=since_s)
        return self._at(person.track, person, 0.0, now)

    def _after_silence(self, person: Person) -> Person:
        """Return a person after a pause in the updates: unaware, and no smaller than that."""
        return _remembering(person, person)._replace(
            awareness_lower=0.0,
            # The next sighting, which ends the pause, is the first.
            known_s=-self._timing.fresh_within_s,
            radius_m=max(person.radius_m, self._target_m(0.0, person.sigma_m)),
        )

    def _shown(self, track: PersonTrack, before: Person, now: float, stale: bool) -> Person:
        """Return the person of a track in the input, which goes on with theirs."""
        if before.is_lost:
            lower = self._trusted_lower(track, None, now, stale)
            return _remembering(self._at(track, None, lower, now), before)
        lower = self._trusted_lower(track, before, now, stale)
        advance_s = _seen_stamp_s(track) - before.seen_stamp_s
        counts = advance_s > _SAME_STAMP_S and not stale
        shown_s = min(advance_s, self._timing.fresh_within_s) if counts else 0.0
        return self._at(track, before, lower, now, shown_s)

    def _trusted_lower(
        self, track: PersonTrack, before: Person | None, now: float, stale: bool
    ) -> float:
        """Return the lower bound of α that counts, or the one that stands for having noticed.

        It is 0 with stale data, for clutter, and for people out of sight. Without a new frame there
        is no new evidence, whatever the track says. Whoever answers a request is somebody who
        looks, like anybody else: people look before they set off, and no request makes them stay.
        """
        seen_stamp_s, status = _seen_stamp_s(track), track.status
        if stale or status == "tentative" or now - seen_stamp_s > self._timing.fresh_within_s:
            return 0.0
        lower, counts_as = track.awareness_lower, self._policy.noticed_counts_as
        if counts_as is not None and track.noticed >= _NOTICED and status == "confirmed":
            lower = max(lower, counts_as)
        if before is not None and before.is_repeated_by(track):
            return min(lower, before.awareness_lower)
        return lower

    def _at(
        self,
        track: PersonTrack,
        before: Person | None,
        lower: float,
        now: float,
        shown_s: float = 0.0,
    ) -> Person:
        """Return a person at ``now`` with this bound of α, whom new frames show for ``shown_s``.

        At first sight, without one ``before``, the obstacle has the unaware size.
        """
        ahead_s = now - track.stamp_s
        (x, y), (vx, vy) = track.position_odom_m.tolist(), track.velocity_odom_mps.tolist()
        place = x + ahead_s * vx, y + ahead_s * vy
        # Growth ends where the robot stops for lack of data: more would only block its restart.
        grown_s = min(max(ahead_s, 0.0), self._timing.stop_after_s)
        sigma_m = checked_sigma_m(track, place, (vx, vy), grown_s)
        seen_stamp_s, confirmed = _seen_stamp_s(track), track.status != "tentative"
        aware_for_s, departed_mps = track.aware_for_s, track.departed_mps
        radius_m = self._target_m(0.0 if before is None else lower, sigma_m)
        known_s, kept = 0.0, _NOTHING_KEPT
        if before is not None:
            # A late frame is no evidence of awareness, but it does show the position. Without it,
            # the uncertainty of the first sighting would never shrink with a slow camera.
            shrinks = track.status == "confirmed" and before.known_s >= 0.0
            shrunk_m = self._timing.shrink_rate_mps * shown_s if shrinks else 0.0
            radius_m = max(radius_m, before.radius_m - shrunk_m)
            if before.is_repeated_by(track):
                since_s = track.stamp_s - before.track.stamp_s
                aware_for_s = min(aware_for_s, max(before.aware_for_s - since_s, 0.0))
                departed_mps = max(departed_mps, before.departed_mps)
            seen_stamp_s = max(seen_stamp_s, before.seen_stamp_s)
            known_s = before.known_s + shown_s
            confirmed = confirmed or before.was_confirmed
            kept = before.lost_since_s, before.lost_limit_mps, before.asked, before.warned_s
        return Person(
            track.id if before is None else before.id,
            track,
            (x, y),
            place,
            (vx, vy),
            seen_stamp_s,
            lower,
            aware_for_s,
            departed_mps,
            radius_m,
            sigma_m,
            known_s,
            confirmed,
            *kept,
        )

    def _target_m(self, lower: float, sigma_m: float) -> float:
        """Return the radius that this awareness allows."""
        radius_m = self._policy_radius_m(lower) if lower else self._unaware_m
        return radius_m + self._margins.uncertainty_sigmas * sigma_m

    def _policy_radius_m(self, awareness_lower: float) -> float:
        """Return the policy's radius, or the smallest with which the limit beside it is usable."""
        radius_m = self._radius_of(awareness_lower)
        if not _is_finite_float(radius_m):
            name = f"{type(self._policy.inflation).__name__}.radius_m({awareness_lower:g})"
            radius_m = finite_number(name, radius_m, NavError)
        return max(radius_m, self._passing_m(self._policy_speed_mps(awareness_lower)))

    def _passing_m(self, speed_mps: float) -> float:
        """Return :func:`~nav_adapter.limit.passing_radius_m`, between the speeds of the policy."""
        speeds, radii = self._passing_speeds, self._passing_radii
        for index in range(1, len(speeds)):
            if speed_mps <= speeds[index]:
                share = (speed_mps - speeds[index - 1]) / (speeds[index] - speeds[index - 1])
                return radii[index - 1] + max(share, 0.0) * (radii[index] - radii[index - 1])
        return radii[-1]

    def _policy_speed_mps(self, awareness_lower: float) -> float:
        return human_speed_mps(self._policy, awareness_lower)


def _seen_stamp_s(track: PersonTrack) -> float:
    """Return the stamp of the latest frame that showed a track."""
    return track.stamp_s - track.time_since_seen_s


def human_speed_mps(policy: AwarenessPolicy, awareness_lower: float) -> float:
    """Return U of a policy, whose speed may be an object of any kind.

    Raises:
        NavError: for a speed that is not finite or below 0.
    """
    speed_mps = policy.speed.human_speed_mps(awareness_lower)
    if _is_finite_float(speed_mps) and speed_mps >= 0.0:
        return speed_mps
    name = f"{type(policy.speed).__name__}.human_speed_mps({awareness_lower:g})"
    return finite_number(name, speed_mps, NavError, minimum=0.0)


def _remembering(person: Person, before: Person | None) -> Person:
    """Return a person with what the robot has said to them, but no answer: it may be another."""
    if before is None:
        return person
    asked = before.asked and before.asked._replace(answered=False)
    return person._replace(asked=asked, warned_s=before.warned_s)


def _is_finite_float(value: float) -> bool:
    """Return whether a value needs no further check; a custom policy may return anything."""
    return type(value) is float and math.isfinite(value)


def _require_non_increasing(function: Callable[[float], float], name: str, unit: str) -> None:
    """Refuse a custom policy whose value grows with awareness."""
    before = function(0.0)
    for alpha in np.linspace(0.0, 1.0, 101).tolist():
        after = function(alpha)
        if after > before + 1e-9:
            raise NavError(
                f"{name} must not grow with awareness, got {before:g} {unit} below and {after:g} "
                f"{unit} at awareness_lower = {alpha:g}"
            )
        before = after
