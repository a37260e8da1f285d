"""The people that the adapter remembers from one update to the next, and how far it trusts α."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import Final, NamedTuple

import numpy as np

from perception.arrays import finite_number
from tracking import PersonTrack

from ._errors import NavError
from ._places import has_jumped, position_sigma_m
from ._policy import AwarenessPolicy
from ._robot import RobotProfile
from .limit import passing_radius_m

Vector2 = tuple[float, float]

# Awareness raises no speed before frames have shown a person for this long.
_FIRST_SIGHT_S: Final = 0.2
# The belief in having noticed the robot from which it counts.
_NOTICED: Final = 0.5
# Walking speed of ISO 13855: the way that explains a new place, at least.
_WALKER_MPS: Final = 1.6
# Stamps closer than this are equal: the stamp of a sighting is a difference of floats, computed
# anew for every frame.
_SAME_STAMP_S: Final = 1e-6
# Tolerance for rounding where sums of frame periods are compared with a setting.
_ROUNDING_S: Final = 1e-9
# The id of somebody whose own now belongs to another; −1 is that of the bridge's stop polygon.
_FIRST_KEPT_ID: Final = -2


class Person(NamedTuple):
    """One person as of the adapter's last update.

    Values of the track that every rule needs are kept as floats, since reading them from their
    arrays again and again would take longer than the rules.

    Attributes:
        track: the latest track of this person.
        track_position_odom_m: position of the track, at its own stamp.
        position_odom_m: position predicted to the update.
        velocity_odom_mps: velocity of the track.
        seen_stamp_s: stamp of the latest frame that showed the person.
        awareness_lower: the lower bound of α that was used.
        radius_m: radius of the obstacle.
        sigma_m: standard deviation of the position along its most uncertain direction.
        known_s: time for which frames have shown the person.
        was_confirmed: whether the track has ever been more than tentative.
        lost_since_s: when a person who was dropped ceased to count in full; None for one who has
            not been dropped.
        lost_limit_mps: the limit that they set then, once it is known.
    """

    track: PersonTrack
    track_position_odom_m: Vector2
    position_odom_m: Vector2
    velocity_odom_mps: Vector2
    seen_stamp_s: float
    awareness_lower: float
    radius_m: float
    sigma_m: float
    known_s: float
    was_confirmed: bool
    lost_since_s: float | None = None
    lost_limit_mps: float | None = None

    @property
    def is_at_first_sight(self) -> bool:
        """True until frames have shown this person long enough for awareness to raise a speed."""
        return self.known_s < _FIRST_SIGHT_S - _ROUNDING_S

    def lost_for_s(self, stamp_s: float) -> float:
        """Return for how long a person has been lost; 0 for one who has not been dropped."""
        return 0.0 if self.lost_since_s is None else stamp_s - self.lost_since_s

    def is_kept(self, stamp_s: float, hold_s: float) -> bool:
        """Return whether a person who is missing from the input must be kept at ``stamp_s``.

        The tracker of this project reports a coasting person before it deletes the track. Another
        tracker may delete a track as soon as a detection fails, which is when the person is most
        likely hidden and still there. A track that was never more than tentative may be clutter and
        is not kept.
        """
        return self.was_confirmed and stamp_s - self.seen_stamp_s <= hold_s


class People:
    """Rules by which people are followed, trusted and sized. The caller keeps the people.

    Obstacles grow at once. They shrink at a bounded rate, only in time in which frames showed a
    confirmed person. While no frame does, neither repeated nor predicted tracks shrink an obstacle
    or raise awareness.

    Awareness raises no speed until frames have shown a person for 0.2 s. A known id at a place that
    the person could not have reached belongs to a new, unaware person. The person who had it is
    kept for ``hold_s`` under a negative id.

    Args:
        policy: radii, human speeds, margins and time behaviour.
        robot: decides how large a circle must be for the limit beside it.

    Raises:
        NavError: for a custom policy object whose values are not finite or grow with awareness.
    """

    def __init__(self, policy: AwarenessPolicy, robot: RobotProfile) -> None:
        self._policy, self._timing, self._margins = policy, policy.timing, policy.margins
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
            passing_radius_m(each, reach, self._margins.clearance_m, robot)
            for each in self._passing_speeds
        ]
        _require_non_increasing(self._policy_radius_m, type(inflation).__name__, "m")

    def updated(
        self,
        people: Mapping[int, Person],
        tracks: tuple[PersonTrack, ...],
        now: float,
        stale: bool,
        answered: Collection[int] = (),
    ) -> dict[int, Person]:
        """Return all people as of ``now``, in the order of their ids.

        Args:
            people: of the update before.
            tracks: the input.
            now: stamp of the update.
            stale: whether the data are too old to trust.
            answered: who has just looked because the robot asked for it.
        """
        jumped = {
            track.id
            for track in tracks
            if track.id in people and has_jumped(people[track.id].track, track, self._jump_mps)
        }
        current = {
            track.id: self._at(track, None, 0.0, now)
            if track.id in jumped
            else self._tracked(track, people.get(track.id), now, stale, track.id in answered)
            for track in tracks
        }
        if jumped:
            people = self._without_owner(people, jumped, tracks)
        for track_id, person in people.items():
            if track_id not in current and person.is_kept(now, self._timing.hold_s):
                current[track_id] = self._missing(person, now)
        return dict(sorted(current.items()))

    def lost(
        self,
        lost: Mapping[int, Person],
        before: Mapping[int, Person],
        before_s: float | None,
        people: Mapping[int, Person],
        now: float,
    ) -> dict[int, Person]:
        """Return all lost people as of ``now``; nobody who is there is lost.

        A tracker gives somebody up when they have been out of sight for long, which is when least
        is known of them. Nobody is lost whose place a sensor has shown empty
        (:attr:`~tracking.PersonTrack.place_empty`).

        Args:
            lost: of the update before.
            before: people of the update before.
            before_s: its stamp, or None if there was none.
            people: who are there now.
            now: stamp of the update.
        """
        if self._timing.lost_rise_mps2 is None or before_s is None:
            return {}
        missing = {track_id: person for track_id, person in lost.items() if track_id not in people}
        for track_id, person in before.items():
            if track_id in people or not person.was_confirmed or person.track.place_empty:
                continue
            # After a pause in the updates they have been lost for some time.
            since_s = min(max(person.seen_stamp_s + self._timing.hold_s, before_s), now)
            missing[track_id] = person._replace(lost_since_s=since_s, lost_limit_mps=None)
        return {track_id: self._missing(person, now) for track_id, person in missing.items()}

    def after_silence(self, people: Mapping[int, Person]) -> dict[int, Person]:
        """Return the people after a pause in the updates: unaware, and no smaller than that."""
        return {
            track_id: person._replace(
                awareness_lower=0.0,
                # The next sighting, which ends the pause, is the first.
                known_s=-self._timing.fresh_within_s,
                radius_m=max(person.radius_m, self._target_m(0.0, person.sigma_m)),
            )
            for track_id, person in people.items()
        }

    def _tracked(
        self,
        track: PersonTrack,
        before: Person | None,
        now: float,
        stale: bool,
        answered: bool,
    ) -> Person:
        """Return the person of a track in the input."""
        seen_stamp_s, fresh_s = track.stamp_s - track.time_since_seen_s, self._timing.fresh_within_s
        lower = 0.0
        if not stale and track.status != "tentative" and now - seen_stamp_s <= fresh_s:
            lower = max(track.awareness_lower, self._noticed_lower(track, answered))
        if before is None:
            return self._at(track, None, lower, now)
        advance_s = seen_stamp_s - before.seen_stamp_s
        if advance_s <= _SAME_STAMP_S:
            # Without a new frame there is no new evidence, whatever the track says.
            advance_s, lower = 0.0, min(lower, before.awareness_lower)
        return self._at(track, before, lower, now, 0.0 if stale else min(advance_s, fresh_s))

    def _missing(self, person: Person, now: float) -> Person:
        """Return a person who is missing from the input: unaware, and walking on."""
        return self._at(person.track, person, 0.0, now)

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
        # Growth ends where the robot stops for lack of data: more would only block its restart.
        sigma_m = position_sigma_m(track, min(max(ahead_s, 0.0), self._timing.stop_after_s))
        person = Person(
            track=track,
            track_position_odom_m=(x, y),
            position_odom_m=(x + ahead_s * vx, y + ahead_s * vy),
            velocity_odom_mps=(vx, vy),
            seen_stamp_s=track.stamp_s - track.time_since_seen_s,
            awareness_lower=lower,
            radius_m=self._target_m(0.0 if before is None else lower, sigma_m),
            sigma_m=sigma_m,
            known_s=0.0,
            was_confirmed=track.status != "tentative",
        )
        if before is None:
            return person
        # A late frame is no evidence of awareness, but it does show the position. Without it, the
        # uncertainty of the first sighting would never shrink with a slow camera.
        shrinks = track.status == "confirmed" and before.known_s >= 0.0
        shrunk_m = self._timing.shrink_rate_mps * shown_s if shrinks else 0.0
        return person._replace(
            seen_stamp_s=max(person.seen_stamp_s, before.seen_stamp_s),
            radius_m=max(person.radius_m, before.radius_m - shrunk_m),
            known_s=before.known_s + shown_s,
            was_confirmed=person.was_confirmed or before.was_confirmed,
            lost_since_s=before.lost_since_s,
            lost_limit_mps=before.lost_limit_mps,
        )

    def _noticed_lower(self, track: PersonTrack, answered: bool) -> float:
        """Return the lower bound of α that stands for having noticed the robot before.

        A look at a robot that has just asked for it is no chance look: the belief counts until it
        ends.
        """
        counts_as = self._policy.noticed_counts_as
        believed = track.noticed >= _NOTICED or (answered and track.noticed > 0.0)
        return (
            counts_as if counts_as is not None and believed and track.status == "confirmed" else 0.0
        )

    def _without_owner(
        self, people: Mapping[int, Person], jumped: set[int], tracks: tuple[PersonTrack, ...]
    ) -> dict[int, Person]:
        """Return the people, those under a new id whose own now belongs to somebody else.

        Somebody whose place has the track of another id that is new or has jumped is known by that
        one; each track stands for one person.
        """
        kept = {track_id: person for track_id, person in people.items() if track_id not in jumped}
        # Clutter, and people who are known by their own id, explain nobody's absence.
        takers = [
            track
            for track in sorted(tracks, key=lambda track: track.id)
            if track.status != "tentative" and (track.id in jumped or track.id not in people)
        ]
        for track_id in sorted(jumped):
            person = people[track_id]
            near = [each for each in takers if not has_jumped(person.track, each, self._jump_mps)]
            if near:
                takers.remove(near[0])
            else:
                kept[min(_FIRST_KEPT_ID + 1, *kept, *people) - 1] = person
        return kept

    def _target_m(self, lower: float, sigma_m: float) -> float:
        """Return the radius that this awareness allows."""
        return self._policy_radius_m(lower) + self._margins.uncertainty_sigmas * sigma_m

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
