"""Tracks in, constraints for a local planner out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import shapely

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import finite_number
from tracking import PersonTrack

from ._constraints import NavConstraints, PersonObstacle
from ._errors import NavError
from ._footprint import Footprint
from ._memory import PersonMemory, position_at, position_sigma_m
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState
from ._separation import max_speed_mps

# Clocks of two machines, or of a camera and a control loop, differ by this much without harm.
_CLOCK_TOLERANCE_S = 0.05

_POLYGON_SIDES = 24
_ANGLES = np.arange(_POLYGON_SIDES) * (2.0 * math.pi / _POLYGON_SIDES)
# Stretched so that the sides, not the corners, touch the circle: the polygon contains it.
_UNIT_POLYGON = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1) / math.cos(
    math.pi / _POLYGON_SIDES
)


class NavAdapter:
    """Turns tracked people into obstacles and a speed limit.

    A person's radius is the policy's, for the lower bound of their α, plus ``uncertainty_sigmas``
    standard deviations of their position, and never below the floor (body radius plus minimum
    clearance). It grows at once. It shrinks at a bounded rate and only by what a *new sighting* of
    a confirmed person pays for: as long as no frame shows the person, however the tracks are
    repeated or predicted, neither the radius shrinks nor the awareness rises.

    The speed limit is the smallest v_max of speed-and-separation monitoring over all people, with
    the human speed that the policy assumes. The separation runs from the robot's footprint to the
    person's body circle (radius 0.30 m), not to the inflated obstacle.

    Tentative people, people unseen for longer than ``fresh_within_s`` and, when the data are stale,
    all people count as unaware.

    Args:
        policy: radii, human speeds, margins and time behaviour.
        robot: footprint, braking and reaction time.

    Raises:
        NavError: an argument of the wrong type, or an own policy object that gives numbers that are
            not finite or that grow with awareness.
    """

    def __init__(self, policy: AwarenessPolicy, robot: RobotProfile) -> None:
        if not isinstance(policy, AwarenessPolicy):
            raise NavError(f"policy must be an AwarenessPolicy, got {type(policy).__name__}")
        if not isinstance(robot, RobotProfile):
            raise NavError(f"robot must be a RobotProfile, got {type(robot).__name__}")
        self._policy = policy
        self._robot = robot
        self._footprint = Footprint(robot.footprint_m)
        self._floor_m = BODY_RADIUS_M + policy.margins.minimum_clearance_m
        _require_non_increasing(self._policy_radius_m, type(policy.inflation).__name__, "m")
        _require_non_increasing(self._policy_human_speed_mps, type(policy.speed).__name__, "m/s")
        self._unaware_human_speed_mps = self._policy_human_speed_mps(0.0)
        self._people: dict[int, PersonMemory] = {}
        self._stamp_s: float | None = None

    def update(
        self,
        tracks: Iterable[PersonTrack],
        robot_state: RobotState,
        stamp_s: float,
        *,
        perception_stamp_s: float | None = None,
    ) -> NavConstraints:
        """Constraints for the instant ``stamp_s``.

        Args:
            tracks: the tracker's latest; they are carried on to ``stamp_s`` at constant velocity.
            robot_state: the latest; its age counts, too.
            stamp_s: now, never earlier than in the update before.
            perception_stamp_s: the latest frame that perception has worked through, people or none.
                Without it the newest track stands in, and an empty ``tracks`` reads as "nobody
                there": only with it does a dead camera stop a robot that saw nobody.

        Returns:
            Obstacles ordered by track id, and the speed limit with the rule that set it.

        Raises:
            NavError: input of the wrong type, not finite, twice the same id, a stamp before the
                last one or data from the future. The adapter is then as it was before the call.
        """
        now = self._checked_stamp(stamp_s)
        current = _checked_tracks(tracks, now)
        if not isinstance(robot_state, RobotState):
            raise NavError(f"robot_state must be a RobotState, got {type(robot_state).__name__}")
        robot_age_s = _age_s("robot_state.stamp_s", robot_state.stamp_s, now)
        if perception_stamp_s is not None:
            seen = finite_number("perception_stamp_s", perception_stamp_s, NavError)
            perception_age_s = _age_s("perception_stamp_s", seen, now)
        else:
            perception_age_s = max(0.0, now - max((t.stamp_s for t in current), default=now))

        timing = self._policy.timing
        stale = max(robot_age_s, perception_age_s) > timing.stale_after_s
        people = {track.id: self._remember(track, now, stale) for track in current}
        for track_id, memory in self._people.items():
            if track_id not in people and memory.is_held(now, timing.hold_s):
                people[track_id] = self._hold(memory, now)
        people = dict(sorted(people.items()))

        limit_mps, limited_by = self._speed_limit(people, robot_state, now, robot_age_s)
        for name, age_s in (("perception", perception_age_s), ("robot state", robot_age_s)):
            if age_s > timing.stop_after_s:
                limit_mps, limited_by = 0.0, f"stale data: {name} is {age_s:.2f} s old"
        braked_mps = abs(robot_state.speed_mps) - self._robot.max_deceleration_mps2 * (
            now - (now if self._stamp_s is None else self._stamp_s)
        )
        constraints = NavConstraints(
            stamp_s=now,
            obstacles=_obstacles(people, now),
            speed_limit_mps=limit_mps,
            limited_by=limited_by,
            stale=stale,
            reachable_speed_limit_mps=max(limit_mps, braked_mps),
        )
        # Nothing can fail from here on: whatever was refused above has left no trace.
        self._people = people
        self._stamp_s = now
        return constraints

    def _checked_stamp(self, stamp_s: float) -> float:
        now = finite_number("stamp_s", stamp_s, NavError)
        if self._stamp_s is not None and now < self._stamp_s:
            raise NavError(
                f"stamp_s must not go backward, got {now:.6f} s after {self._stamp_s:.6f} s"
            )
        return now

    def _policy_radius_m(self, awareness_lower: float) -> float:
        radius_m = self._policy.inflation.radius_m(awareness_lower)
        name = f"{type(self._policy.inflation).__name__}.radius_m({awareness_lower:g})"
        return max(self._floor_m, finite_number(name, radius_m, NavError))

    def _policy_human_speed_mps(self, awareness_lower: float) -> float:
        speed_mps = self._policy.speed.human_speed_mps(awareness_lower)
        name = f"{type(self._policy.speed).__name__}.human_speed_mps({awareness_lower:g})"
        return finite_number(name, speed_mps, NavError, minimum=0.0)

    def _remember(self, track: PersonTrack, now: float, stale: bool) -> PersonMemory:
        """The person of a track that is in the input."""
        timing, before = self._policy.timing, self._people.get(track.id)
        seen_stamp_s = track.stamp_s - track.time_since_seen_s
        trusted = (
            not stale
            and track.status != "tentative"
            and now - seen_stamp_s <= timing.fresh_within_s
        )
        lower = track.awareness_lower if trusted else 0.0
        sigma_m = position_sigma_m(track, now)
        if before is None:
            # Nobody is known to be aware at first sight: the first radius is the unaware one.
            radius_m = self._target_radius_m(0.0, sigma_m)
            return PersonMemory(track, seen_stamp_s, lower, radius_m, sigma_m)

        newly_seen_s = before.newly_seen_s(seen_stamp_s)
        if newly_seen_s == 0.0:
            # No new frame, no new evidence: also not from a tracker that claims otherwise.
            lower = min(lower, before.awareness_lower)
        radius_m = self._target_radius_m(lower, sigma_m)
        if radius_m < before.radius_m:
            may_shrink = trusted and track.status == "confirmed"
            paid_s = min(newly_seen_s, timing.fresh_within_s) if may_shrink else 0.0
            radius_m = max(radius_m, before.radius_m - timing.shrink_rate_mps * paid_s)
        return PersonMemory(
            track=track,
            seen_stamp_s=seen_stamp_s if newly_seen_s > 0.0 else before.seen_stamp_s,
            awareness_lower=lower,
            radius_m=radius_m,
            sigma_m=sigma_m,
        )

    def _hold(self, memory: PersonMemory, now: float) -> PersonMemory:
        """The person of a track that has vanished: unaware, walking on, never smaller."""
        sigma_m = position_sigma_m(memory.track, now)
        return replace(
            memory,
            awareness_lower=0.0,
            radius_m=max(memory.radius_m, self._target_radius_m(0.0, sigma_m)),
            sigma_m=sigma_m,
        )

    def _target_radius_m(self, awareness_lower: float, sigma_m: float) -> float:
        margin_m = self._policy.margins.uncertainty_sigmas * sigma_m
        return self._policy_radius_m(awareness_lower) + margin_m

    def _speed_limit(
        self,
        people: dict[int, PersonMemory],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> tuple[float, str]:
        """Smallest v_max of all people, m/s, and the rule that set it."""
        maximum_mps = self._robot.max_speed_mps
        if not people:
            return maximum_mps, "robot maximum"
        memories = people.values()
        # Carrying a person on may only bring them nearer: they may have turned round since.
        candidates = [position_at(m.track, now) for m in memories]
        candidates += [tuple(m.track.position_odom_m.tolist()) for m in memories]
        distance_m = self._footprint.distance_m(np.array(candidates), robot_state)
        distance_m = distance_m.reshape(2, -1).min(axis=0)
        margins = self._policy.margins
        lost_m = BODY_RADIUS_M + abs(robot_state.speed_mps) * robot_age_s
        limits_mps = max_speed_mps(
            distance_m - [lost_m + margins.uncertainty_sigmas * m.sigma_m for m in memories],
            [self._human_speed_mps(m, robot_state) for m in memories],
            deceleration_mps2=self._robot.max_deceleration_mps2,
            reaction_time_s=[
                self._robot.reaction_time_s + max(0.0, now - m.track.stamp_s) for m in memories
            ],
            clearance_m=margins.separation_clearance_m,
        )
        nearest = int(limits_mps.argmin())
        limit_mps = float(limits_mps[nearest])
        if limit_mps >= maximum_mps:
            return maximum_mps, "robot maximum"
        return limit_mps, f"track {list(people)[nearest]}: speed and separation"

    def _human_speed_mps(self, memory: PersonMemory, robot_state: RobotState) -> float:
        """The policy's assumption, but at least the speed at which the track closes in.

        Awareness is a reason to expect that somebody will not step towards the robot, not a reason
        to overlook that they do. What a person walks faster than an unaware one may is added: an
        attentive runner cannot stop as fast as an attentive walker, and an unaware one is already
        faster than the walking speed of the standard.
        """
        vx, vy = memory.track.velocity_odom_mps.tolist()
        x, y = (memory.track.position_odom_m - robot_state.position_odom_m).tolist()
        excess_mps = max(0.0, math.hypot(vx, vy) - self._unaware_human_speed_mps)
        closing_mps = -(vx * x + vy * y) / max(math.hypot(x, y), 1e-9)
        policy_mps = self._policy_human_speed_mps(memory.awareness_lower)
        return float(max(policy_mps + excess_mps, closing_mps))


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


def _age_s(name: str, stamp_s: float, now: float) -> float:
    if stamp_s > now + _CLOCK_TOLERANCE_S:
        raise NavError(
            f"{name} must not lie after stamp_s, got {stamp_s:.6f} s and {now:.6f} s "
            f"(tolerance {_CLOCK_TOLERANCE_S:g} s)"
        )
    return max(0.0, now - stamp_s)


def _checked_tracks(tracks: Iterable[PersonTrack], now: float) -> tuple[PersonTrack, ...]:
    try:
        checked = tuple(tracks)
    except TypeError:
        raise NavError(
            f"tracks must be an iterable of PersonTrack, got {type(tracks).__name__}"
        ) from None
    ids: set[int] = set()
    for index, track in enumerate(checked):
        if not isinstance(track, PersonTrack):
            raise NavError(f"tracks[{index}] must be a PersonTrack, got {type(track).__name__}")
        if track.id in ids:
            raise NavError(f"tracks must have distinct ids, got id {track.id} twice")
        ids.add(track.id)
        _age_s(f"tracks[{index}].stamp_s", track.stamp_s, now)
    return checked


def _obstacles(people: dict[int, PersonMemory], now: float) -> tuple[PersonObstacle, ...]:
    if not people:
        return ()
    centers = np.array([position_at(m.track, now) for m in people.values()])
    radii = np.array([m.radius_m for m in people.values()])
    polygons = shapely.polygons(centers[:, None] + radii[:, None, None] * _UNIT_POLYGON)
    return tuple(
        PersonObstacle(
            track_id=track_id,
            center_odom_m=center,
            velocity_odom_mps=memory.track.velocity_odom_mps,
            radius_m=memory.radius_m,
            height_m=memory.track.height_m,
            awareness_lower=memory.awareness_lower,
            polygon=polygon,
        )
        for (track_id, memory), center, polygon in zip(
            people.items(), centers, polygons, strict=True
        )
    )
