"""Rules for the size of each person's obstacle from one update to the next."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Final

import numpy as np

from perception.arrays import finite_number
from tracking import PersonTrack

from ._errors import NavError
from ._memory import (
    ROUNDING_S,
    PersonMemory,
    Vector2,
    extended_history,
    has_jumped,
    motion_at,
    position_sigma_m,
    velocity_variance_m2ps2,
)
from ._policy import AwarenessPolicy

# Below this speed the direction of a velocity is noise.
_WALKING_MPS: Final = 0.1
# The id of somebody whose own now belongs to another; −1 is that of the bridge's stop polygon.
_FIRST_KEPT_ID: Final = -2
# Walking speed of ISO 13855.
_WALKER_MPS: Final = 1.6


class ObstacleRules:
    """Rules by which obstacles grow and shrink. The caller keeps the people.

    Obstacles grow at once. They shrink at a bounded rate, to the largest size called for in the
    last ``shrink_after_s``. Both count only time in which frames showed a confirmed person. While
    no frame does, neither repeated nor predicted tracks shrink an obstacle or raise awareness.

    Awareness raises no speed until frames have shown a person for ``shrink_after_s``. A known id at
    a place that the person could not have reached belongs to a new, unaware person. The person
    who had it is kept for ``hold_s`` under a negative id.

    Args:
        policy: radii, human speeds, margins and time behaviour.

    Raises:
        NavError: for a custom policy object whose values are not finite or grow with awareness.
    """

    def __init__(self, policy: AwarenessPolicy) -> None:
        self._policy = policy
        self._timing = policy.timing
        inflation, speed, margins = policy.inflation, policy.speed, policy.margins
        self._radius_of, self._human_speed_of = inflation.radius_m, speed.human_speed_mps
        self._floor_m, self._sigmas = margins.floor_m, margins.uncertainty_sigmas
        ceiling_m = margins.maximum_radius_m
        self._ceiling_m = math.inf if ceiling_m is None else ceiling_m
        self._elongates = policy.outline.unaware_ahead_s > 0.0
        _require_non_increasing(self._policy_radius_m, type(inflation).__name__, "m")
        _require_non_increasing(self._policy_human_speed_mps, type(speed).__name__, "m/s")
        self.unaware_human_speed_mps = self._policy_human_speed_mps(0.0)
        # The way that explains a new place. People walk even where their speed does not count.
        self._jump_mps = self.unaware_human_speed_mps
        if policy.rules.protective_field is not None:
            self._jump_mps = max(self._jump_mps, _WALKER_MPS)
        self._inflation_holds = _hysteresis_of(inflation)
        self._speed_holds = _hysteresis_of(speed)

    def updated(
        self,
        people: Mapping[int, PersonMemory],
        tracks: Iterable[PersonTrack],
        now: float,
        stale: bool,
    ) -> dict[int, PersonMemory]:
        """Return all people as of ``now``, in the order of their ids.

        Args:
            people: of the update before.
            tracks: the input.
            now: stamp of the update.
            stale: whether the data are too old to trust.
        """
        tracks = tuple(tracks)
        jumped = {
            track.id
            for track in tracks
            if track.id in people and has_jumped(people[track.id], track, self._jump_mps)
        }
        current = {
            track.id: self._tracked_person(
                track, people.get(track.id), now, stale=stale, jumped=track.id in jumped
            )
            for track in tracks
        }
        if jumped:
            people = self._without_owner(people, jumped, tracks)
        for track_id, memory in people.items():
            if track_id not in current and memory.is_kept(now, self._timing.hold_s):
                current[track_id] = self.missing_person(memory, now)
        return dict(sorted(current.items()))

    def _without_owner(
        self,
        people: Mapping[int, PersonMemory],
        jumped: set[int],
        tracks: tuple[PersonTrack, ...],
    ) -> dict[int, PersonMemory]:
        """Return the people, those under a new id whose own now belongs to somebody else.

        Somebody whose place has the track of another id that is new or has jumped is known by that
        one; each track stands for one person.
        """
        kept = {track_id: memory for track_id, memory in people.items() if track_id not in jumped}
        # Clutter, and people who are known by their own id, explain nobody's absence.
        takers = [
            track
            for track in tracks
            if track.status != "tentative" and (track.id in jumped or track.id not in people)
        ]
        for track_id in sorted(jumped):
            memory = people[track_id]
            near = [each for each in takers if not has_jumped(memory, each, self._jump_mps)]
            if near:
                takers.remove(near[0])
            else:
                kept[min(_FIRST_KEPT_ID + 1, *kept, *people) - 1] = memory
        return kept

    def after_silence(self, people: Mapping[int, PersonMemory]) -> dict[int, PersonMemory]:
        """Return the people after a pause in the updates: unaware, and no smaller than that."""
        unaware = {}
        for track_id, memory in people.items():
            radius_m, ahead_m = self._target_m(memory.velocity_odom_mps, 0.0, memory.sigma_m)
            unaware[track_id] = memory._replace(
                awareness_lower=0.0,
                # The next sighting, which ends the pause, is the first.
                known_s=-self._timing.fresh_within_s,
                radius_m=max(memory.radius_m, radius_m),
                ahead_m=max(memory.ahead_m, ahead_m),
                history=((memory.visible_s, radius_m, ahead_m),),
                inflation_held=False,
                speed_held=False,
            )
        return unaware

    def missing_person(self, memory: PersonMemory, now: float) -> PersonMemory:
        """Return a person who is missing from the input: unaware, and walking on."""
        return self._known_person(memory.track, memory, 0.0, now, visible_s=0.0)

    def human_speed_mps(self, memory: PersonMemory) -> float:
        """Return the speed that the policy assumes for a person.

        At first sight, and until frames have shown the person for ``shrink_after_s``, it is that
        for unaware people.
        """
        if self._is_first_sight(memory):
            return self.unaware_human_speed_mps
        return self._policy_human_speed_mps(1.0 if memory.speed_held else memory.awareness_lower)

    def _tracked_person(
        self,
        track: PersonTrack,
        before: PersonMemory | None,
        now: float,
        *,
        stale: bool,
        jumped: bool,
    ) -> PersonMemory:
        """Return the person of a track in the input."""
        timing = self._timing
        seen_stamp_s = track.stamp_s - track.time_since_seen_s
        trusted = (
            not stale
            and not jumped
            and track.status != "tentative"
            and now - seen_stamp_s <= timing.fresh_within_s
        )
        looks_lower = track.awareness_lower if trusted else 0.0
        noticed_lower = self._noticed_lower(track) if trusted else 0.0
        if before is None or jumped:
            return self._new_person(track, seen_stamp_s, looks_lower, now, noticed_lower)
        newly_seen_s = before.newly_seen_s(seen_stamp_s)
        known_s = before.known_s + (0.0 if stale else min(newly_seen_s, timing.fresh_within_s))
        if newly_seen_s == 0.0:
            # Without a new frame there is no new evidence, whatever the track says.
            looks_lower = min(looks_lower, before.awareness_lower)
            noticed_lower = min(noticed_lower, before.awareness_lower)
        # A late frame is no evidence of awareness, but it does show the position. Without it, the
        # uncertainty of the first sighting would never shrink with a slow camera.
        counts = not stale and track.status == "confirmed"
        visible_s = min(newly_seen_s, timing.fresh_within_s) if counts else 0.0
        person = self._known_person(
            track,
            before._replace(known_s=known_s),
            looks_lower,
            now,
            visible_s=visible_s,
            seen_stamp_s=seen_stamp_s,
            noticed_lower=noticed_lower,
        )
        if not trusted or track.status != "confirmed" or self._is_first_sight(person):
            return person
        # Between the frame that showed the person and the track's stamp nobody looked.
        return self._bounded(person, max(track.stamp_s - seen_stamp_s, 0.0))

    def _bounded(self, person: PersonMemory, unseen_s: float) -> PersonMemory:
        """Return a freshly seen person with the bounds on human acceleration that hold."""
        rules, track = self._policy.rules, person.track
        if rules.standing is None and rules.walking is None:
            return person
        variance_m2ps2 = velocity_variance_m2ps2(track)
        start_delay_s = turn_delay_s = math.inf
        spread_mps = 0.0
        if rules.standing is not None and rules.standing.is_standing(
            math.hypot(*person.velocity_odom_mps), variance_m2ps2
        ):
            start_delay_s = rules.standing.delay_s(unseen_s, math.inf, 0.0)
        if rules.walking is not None:
            turn_delay_s = rules.walking.turn_delay_s + unseen_s
            spread_mps = rules.walking.velocity_sigmas * math.sqrt(variance_m2ps2)
        return person._replace(
            start_delay_s=start_delay_s, turn_delay_s=turn_delay_s, velocity_spread_mps=spread_mps
        )

    def _noticed_lower(self, track: PersonTrack) -> float:
        """Return the lower bound of α that stands for having noticed the robot before."""
        rule = self._policy.noticed
        if rule is None or track.status != "confirmed" or track.noticed < rule.at_least:
            return 0.0
        return rule.counts_as_awareness

    def _is_first_sight(self, memory: PersonMemory) -> bool:
        """Return whether frames have shown a person for less than ``shrink_after_s``."""
        return memory.known_s < self._timing.shrink_after_s - ROUNDING_S

    def _new_person(
        self,
        track: PersonTrack,
        seen_stamp_s: float,
        looks_lower: float,
        now: float,
        noticed_lower: float,
    ) -> PersonMemory:
        """Return a person at first sight, whose obstacle has the unaware size."""
        sigma_m = self._sigma_m(track, now)
        track_position, position, velocity = motion_at(track, now)
        radius_m, ahead_m = self._target_m(velocity, 0.0, sigma_m)
        return PersonMemory(
            track=track,
            track_position_odom_m=track_position,
            position_odom_m=position,
            velocity_odom_mps=velocity,
            seen_stamp_s=seen_stamp_s,
            awareness_lower=max(looks_lower, noticed_lower),
            radius_m=radius_m,
            sigma_m=sigma_m,
            visible_s=0.0,
            known_s=0.0,
            was_confirmed=track.status != "tentative",
            ahead_m=ahead_m,
            direction_odom=_walking_direction(velocity, (1.0, 0.0)),
            history=((0.0, radius_m, ahead_m),),
            inflation_held=self._inflation_holds(looks_lower, False),
            speed_held=self._speed_holds(looks_lower, False),
        )

    def _known_person(
        self,
        track: PersonTrack,
        before: PersonMemory,
        looks_lower: float,
        now: float,
        *,
        visible_s: float,
        seen_stamp_s: float = -math.inf,
        noticed_lower: float = 0.0,
    ) -> PersonMemory:
        """Return a person known from before, now with the bound ``looks_lower`` of α.

        Only looks hold a person at the level of a policy with hysteresis; having noticed does not.
        """
        timing = self._timing
        sigma_m = self._sigma_m(track, now)
        lower = max(looks_lower, noticed_lower)
        held = self._inflation_holds(looks_lower, before.inflation_held)
        track_position, position, velocity = motion_at(track, now)
        target = self._target_m(velocity, 1.0 if held else lower, sigma_m)
        total_visible_s = before.visible_s + visible_s
        shown = target
        if visible_s == 0.0:
            # Without a new frame a smaller size is no evidence that it has held.
            shown = max(target[0], before.history[-1][1]), max(target[1], before.history[-1][2])
        history = extended_history(before.history, (total_visible_s, *shown), timing.shrink_after_s)
        shrink_m = timing.shrink_rate_mps * visible_s
        radius_m, ahead_m = target
        if len(history) > 1:
            radius_m = max(entry[1] for entry in history)
            ahead_m = max(entry[2] for entry in history)
        return PersonMemory(
            track=track,
            track_position_odom_m=track_position,
            position_odom_m=position,
            velocity_odom_mps=velocity,
            seen_stamp_s=max(before.seen_stamp_s, seen_stamp_s),
            awareness_lower=lower,
            radius_m=max(radius_m, before.radius_m - shrink_m),
            sigma_m=sigma_m,
            visible_s=total_visible_s,
            known_s=before.known_s,
            was_confirmed=before.was_confirmed or track.status != "tentative",
            ahead_m=max(ahead_m, before.ahead_m - shrink_m),
            direction_odom=_walking_direction(velocity, before.direction_odom),
            history=history,
            inflation_held=held,
            speed_held=self._speed_holds(looks_lower, before.speed_held),
        )

    def _target_m(self, velocity: Vector2, awareness: float, sigma_m: float) -> Vector2:
        """Return the radius and the length ahead that this awareness allows."""
        radius_m = self._bounded_m(self._policy_radius_m(awareness) + self._sigmas * sigma_m)
        if not self._elongates:
            return radius_m, 0.0
        outline = self._policy.outline
        walking_mps = math.hypot(*velocity)
        return radius_m, min(outline.ahead_s(awareness) * walking_mps, outline.longest_ahead_m)

    def _sigma_m(self, track: PersonTrack, now: float) -> float:
        # Growth ends where the robot stops for lack of data: more would only block its restart.
        return position_sigma_m(track, min(now, track.stamp_s + self._timing.stop_after_s))

    def _bounded_m(self, radius_m: float) -> float:
        if radius_m < self._floor_m:
            return self._floor_m
        return self._ceiling_m if radius_m > self._ceiling_m else radius_m

    def _policy_radius_m(self, awareness_lower: float) -> float:
        radius_m = self._radius_of(awareness_lower)
        if not _is_finite_float(radius_m):
            name = f"{type(self._policy.inflation).__name__}.radius_m({awareness_lower:g})"
            radius_m = finite_number(name, radius_m, NavError)
        return self._bounded_m(radius_m)

    def _policy_human_speed_mps(self, awareness_lower: float) -> float:
        speed_mps = self._human_speed_of(awareness_lower)
        if _is_finite_float(speed_mps) and speed_mps >= 0.0:
            return speed_mps
        name = f"{type(self._policy.speed).__name__}.human_speed_mps({awareness_lower:g})"
        return finite_number(name, speed_mps, NavError, minimum=0.0)


def _is_finite_float(value: float) -> bool:
    """Return whether a value needs no further check; a custom policy may return anything."""
    return type(value) is float and math.isfinite(value)


def _walking_direction(velocity: Vector2, before: Vector2) -> Vector2:
    """Return the unit vector of the velocity, or the direction before for a standing person."""
    vx, vy = velocity
    speed_mps = math.hypot(vx, vy)
    return (vx / speed_mps, vy / speed_mps) if speed_mps > _WALKING_MPS else before


def _hysteresis_of(policy: object) -> Callable[[float, bool], bool]:
    """Return the ``holds`` method of a policy, or a function that never holds."""
    holds = getattr(policy, "holds", None)
    if not callable(holds):
        return lambda awareness_lower, held: False
    # No evidence is never "aware", whatever a custom policy returns.
    return lambda awareness_lower, held: (
        awareness_lower > 0.0 and bool(holds(awareness_lower, held))
    )


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
