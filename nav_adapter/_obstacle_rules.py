"""The size of each person's obstacle from one update to the next."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Final

import numpy as np

from perception.arrays import finite_number
from tracking import PersonTrack

from ._errors import NavError
from ._memory import Pair, PersonMemory, motion_at, position_sigma_m
from ._policy import AwarenessPolicy

# Slower than this, the direction of a velocity is noise.
_WALKING_MPS: Final = 0.1
# Sums of frame periods are compared with a setting.
_ROUNDING_S: Final = 1e-9

_History = tuple[tuple[float, float, float], ...]


class ObstacleRules:
    """The rules by which obstacles grow and shrink. The people are the caller's.

    Obstacles grow at once. They shrink to the largest size of the last ``shrink_after_s`` and at a
    bounded rate, both counted in time in which frames showed a confirmed person: as long as no
    frame does, however the tracks are repeated or predicted, neither does an obstacle shrink nor
    awareness rise.

    Args:
        policy: radii, human speeds, margins and time behaviour.

    Raises:
        NavError: an own policy object that gives numbers that are not finite or that grow with
            awareness.
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
        self._inflation_holds = _hysteresis(inflation)
        self._speed_holds = _hysteresis(speed)

    def updated(
        self,
        people: Mapping[int, PersonMemory],
        tracks: Iterable[PersonTrack],
        now: float,
        stale: bool,
    ) -> dict[int, PersonMemory]:
        """Everybody as of ``now``, in the order of their ids, from who was known and the input."""
        known = {
            track.id: self._remember(track, people.get(track.id), now, stale) for track in tracks
        }
        for track_id, memory in people.items():
            if track_id not in known and memory.is_held(now, self._timing.hold_s):
                # Vanished from the input: walking on and unaware.
                known[track_id] = self._updated(memory.track, memory, 0.0, now, visible_s=0.0)
        return dict(sorted(known.items()))

    def after_silence(self, people: Mapping[int, PersonMemory]) -> dict[int, PersonMemory]:
        """The same people after a silence: unaware, and no smaller than at first sight."""
        unaware = {}
        for track_id, memory in people.items():
            radius_m, ahead_m = self._target_m(memory.velocity_odom_mps, 0.0, memory.sigma_m)
            unaware[track_id] = memory._replace(
                awareness_lower=0.0,
                radius_m=max(memory.radius_m, radius_m),
                ahead_m=max(memory.ahead_m, ahead_m),
                history=((memory.visible_s, radius_m, ahead_m),),
                inflation_held=False,
                speed_held=False,
            )
        return unaware

    def human_speed_mps(self, memory: PersonMemory) -> float:
        """The policy's assumption for a person."""
        return self._policy_human_speed_mps(1.0 if memory.speed_held else memory.awareness_lower)

    def _remember(
        self, track: PersonTrack, before: PersonMemory | None, now: float, stale: bool
    ) -> PersonMemory:
        """The person of a track that is in the input."""
        timing = self._timing
        seen_stamp_s = track.stamp_s - track.time_since_seen_s
        trusted = (
            not stale
            and track.status != "tentative"
            and now - seen_stamp_s <= timing.fresh_within_s
        )
        lower = track.awareness_lower if trusted else 0.0
        if before is None:
            return self._first(track, seen_stamp_s, lower, now)
        newly_seen_s = before.newly_seen_s(seen_stamp_s)
        if newly_seen_s == 0.0:
            # No new frame, no new evidence: also not from a tracker that claims otherwise.
            lower = min(lower, before.awareness_lower)
        # A frame that comes late proves no awareness, but it shows where somebody is:
        # else a slow camera would leave the doubt of first sight for ever.
        pays = not stale and track.status == "confirmed"
        visible_s = min(newly_seen_s, timing.fresh_within_s) if pays else 0.0
        return self._updated(
            track, before, lower, now, visible_s=visible_s, seen_stamp_s=seen_stamp_s
        )

    def _first(
        self, track: PersonTrack, seen_stamp_s: float, lower: float, now: float
    ) -> PersonMemory:
        """Nobody is known to be aware at first sight: the first obstacle is the unaware one."""
        sigma_m = self._sigma_m(track, now)
        place, here, velocity = motion_at(track, now)
        radius_m, ahead_m = self._target_m(velocity, 0.0, sigma_m)
        return PersonMemory(
            track=track,
            place_odom_m=place,
            here_odom_m=here,
            velocity_odom_mps=velocity,
            seen_stamp_s=seen_stamp_s,
            awareness_lower=lower,
            radius_m=radius_m,
            sigma_m=sigma_m,
            visible_s=0.0,
            ahead_m=ahead_m,
            facing_odom=_facing(velocity, (1.0, 0.0)),
            history=((0.0, radius_m, ahead_m),),
            inflation_held=self._inflation_holds(lower, False),
            speed_held=self._speed_holds(lower, False),
        )

    def _updated(
        self,
        track: PersonTrack,
        before: PersonMemory,
        lower: float,
        now: float,
        *,
        visible_s: float,
        seen_stamp_s: float = -math.inf,
    ) -> PersonMemory:
        """A person known before, now with this bound of α."""
        timing = self._timing
        sigma_m = self._sigma_m(track, now)
        held = self._inflation_holds(lower, before.inflation_held)
        place, here, velocity = motion_at(track, now)
        target = self._target_m(velocity, 1.0 if held else lower, sigma_m)
        clock_s = before.visible_s + visible_s
        history = _with_history(before.history, (clock_s, *target), timing.shrink_after_s)
        shrink_m = timing.shrink_rate_mps * visible_s
        radius_m, ahead_m = target
        if len(history) > 1:
            radius_m = max(entry[1] for entry in history)
            ahead_m = max(entry[2] for entry in history)
        return PersonMemory(
            track=track,
            place_odom_m=place,
            here_odom_m=here,
            velocity_odom_mps=velocity,
            seen_stamp_s=max(before.seen_stamp_s, seen_stamp_s),
            awareness_lower=lower,
            radius_m=max(radius_m, before.radius_m - shrink_m),
            sigma_m=sigma_m,
            visible_s=clock_s,
            ahead_m=max(ahead_m, before.ahead_m - shrink_m),
            facing_odom=_facing(velocity, before.facing_odom),
            history=history,
            inflation_held=held,
            speed_held=self._speed_holds(lower, before.speed_held),
        )

    def _target_m(self, velocity: Pair, awareness: float, sigma_m: float) -> Pair:
        """Radius and elongation that this awareness allows."""
        radius_m = self._bounded_m(self._policy_radius_m(awareness) + self._sigmas * sigma_m)
        if not self._elongates:
            return radius_m, 0.0
        outline = self._policy.outline
        walking_mps = math.hypot(*velocity)
        return radius_m, min(outline.ahead_s(awareness) * walking_mps, outline.longest_ahead_m)

    def _sigma_m(self, track: PersonTrack, now: float) -> float:
        # Once the robot stands for want of data, doubt that grew on would only block its restart.
        return position_sigma_m(track, min(now, track.stamp_s + self._timing.stop_after_s))

    def _bounded_m(self, radius_m: float) -> float:
        if radius_m < self._floor_m:
            return self._floor_m
        return self._ceiling_m if radius_m > self._ceiling_m else radius_m

    def _policy_radius_m(self, awareness_lower: float) -> float:
        radius_m = self._radius_of(awareness_lower)
        if not _is_plain(radius_m):
            name = f"{type(self._policy.inflation).__name__}.radius_m({awareness_lower:g})"
            radius_m = finite_number(name, radius_m, NavError)
        return self._bounded_m(radius_m)

    def _policy_human_speed_mps(self, awareness_lower: float) -> float:
        speed_mps = self._human_speed_of(awareness_lower)
        if _is_plain(speed_mps) and speed_mps >= 0.0:
            return speed_mps
        name = f"{type(self._policy.speed).__name__}.human_speed_mps({awareness_lower:g})"
        return finite_number(name, speed_mps, NavError, minimum=0.0)


def _is_plain(value: float) -> bool:
    """A finite float, which needs no closer look; an own policy may give anything."""
    return type(value) is float and math.isfinite(value)


def _with_history(
    before: _History, newest: tuple[float, float, float], within_s: float
) -> _History:
    """Return the sizes of the last ``within_s`` that exceed the newest, and the newest.

    The size at one sighting holds until the next, so that the first sighting after an
    absence proves nothing about the time between.
    """
    clock_s, radius_m, ahead_m = newest
    if len(before) == 1 and radius_m >= before[0][1] and ahead_m >= before[0][2]:
        return (newest,)
    held = (*before[:-1], (clock_s, *before[-1][1:]))
    kept = (
        entry
        for entry in held
        if clock_s - entry[0] < within_s - _ROUNDING_S
        and (entry[1] > radius_m or entry[2] > ahead_m)
    )
    return (*kept, newest)


def _facing(velocity: Pair, before: Pair) -> Pair:
    vx, vy = velocity
    speed_mps = math.hypot(vx, vy)
    return (vx / speed_mps, vy / speed_mps) if speed_mps > _WALKING_MPS else before


def _hysteresis(policy: object) -> Callable[[float, bool], bool]:
    holds = getattr(policy, "holds", None)
    if not callable(holds):
        return lambda awareness_lower, held: False
    # No evidence is never "aware", whatever an own policy says.
    return lambda awareness_lower, held: (
        awareness_lower > 0.0 and bool(holds(awareness_lower, held))
    )


def _require_non_increasing(function: Callable[[float], float], name: str, unit: str) -> None:
    """Refuse an own policy that gives less room or more haste to people who are less aware."""
    before = function(0.0)
    for alpha in np.linspace(0.0, 1.0, 101).tolist():
        after = function(alpha)
        if after > before + 1e-9:
            raise NavError(
                f"{name} must not grow with awareness, got {before:g} {unit} below and {after:g} "
                f"{unit} at awareness_lower = {alpha:g}"
            )
        before = after
