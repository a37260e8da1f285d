"""Tracks in, constraints for a local planner out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from perception.arrays import finite_number
from tracking import PersonTrack

from ._alert import Alert
from ._alerting import AlertBook, alerts_due
from ._constraints import NavConstraints
from ._errors import NavError
from ._governor import GovernedSpeed, SpeedGovernor
from ._memory import PersonMemory
from ._obstacle_rules import ObstacleRules
from ._obstacles import obstacles_of
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState

# Clocks of two machines, or of a camera and a control loop, differ by this much without harm.
_CLOCK_TOLERANCE_S = 0.05


class NavAdapter:
    """Turns tracked people into obstacles and a speed limit.

    A person's radius is the policy's, for the lower bound of their α, plus ``uncertainty_sigmas``
    standard deviations of their position, and never below the floor (body radius plus minimum
    clearance). It grows at once. It shrinks at a bounded rate, to what has been allowed for
    ``shrink_after_s``, and only by what a *new sighting* of a confirmed person pays for: as long as
    no frame shows the person, however the tracks are repeated or predicted, neither the radius
    shrinks nor the awareness rises.

    The speed limit is the smallest v_max of speed-and-separation monitoring over all people, with
    the human speed that the policy assumes, and of the policy's other rules. The separation runs
    from the robot to the person's body circle (radius 0.30 m), not to the inflated obstacle. People
    whom the robot cannot meet while it stops limit it less (:class:`SpeedGovernor`).

    Tentative people, people unseen for longer than ``fresh_within_s`` and, when the data are stale,
    all people count as unaware. After stale data, or a pause in the updates as long as that, the
    limit rises from where it was no faster than the robot accelerates.

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
        self._rules = ObstacleRules(policy)
        self._governor = SpeedGovernor(policy, robot, self._rules)
        self._people: dict[int, PersonMemory] = {}
        self._book = AlertBook()
        self._latest: NavConstraints | None = None
        self._latest_input: tuple[tuple[PersonTrack, ...], RobotState, float] | None = None
        # While the limit climbs back after stale data.
        self._ceiling_mps: float | None = None

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
            Obstacles ordered by track id, the speed limit with the rule that set it, and alerts,
            the most urgent first.

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
        else:
            seen = min(now, max((track.stamp_s for track in current), default=now))
        perception_age_s = _age_s("perception_stamp_s", seen, now)

        timing = self._policy.timing
        stale = max(robot_age_s, perception_age_s) > timing.stale_after_s
        people = self._people
        if self._latest is not None and now - self._latest.stamp_s > timing.stale_after_s:
            # Nobody has asked meanwhile, and nobody is known to be aware any more.
            people = self._rules.after_silence(people)
        people = self._rules.updated(people, current, now, stale)
        limit = self._governor.limit(people, robot_state, now, robot_age_s)
        for name, age_s in (("perception", perception_age_s), ("robot state", robot_age_s)):
            if age_s > timing.stop_after_s:
                reason = f"stale data: {name} is {age_s:.2f} s old"
                limit = replace(limit, limit_mps=0.0, limited_by=reason)
        limit, ceiling_mps = self._recovering(limit, robot_state, now, stale)
        alerts: tuple[Alert, ...] = ()
        book = self._book
        if self._policy.alerts is not None and not stale:
            alerts, book = alerts_due(
                self._policy.alerts,
                self._robot,
                people,
                robot_state,
                now,
                self._policy.margins.uncertainty_sigmas,
                book,
            )
        last_s = now if self._latest is None else self._latest.stamp_s
        braked_mps = abs(robot_state.speed_mps) - self._robot.max_deceleration_mps2 * (now - last_s)
        constraints = NavConstraints(
            stamp_s=now,
            obstacles=obstacles_of(people, now, self._policy),
            speed_limit_mps=limit.limit_mps,
            limited_by=limit.limited_by,
            stale=stale,
            reachable_speed_limit_mps=max(limit.limit_mps, braked_mps),
            alerts=alerts,
            braking_suffices=limit.braking_suffices,
        )
        # Nothing can fail from here on: whatever was refused above has left no trace.
        self._people = people
        self._book = book
        self._latest = constraints
        self._latest_input = current, robot_state, seen
        self._ceiling_mps = ceiling_mps
        return constraints

    def watchdog(self, stamp_s: float) -> NavConstraints:
        """Constraints at ``stamp_s`` when nothing new has come: the latest input, grown older.

        For a timer beside the callbacks that call :meth:`update`: first everyone counts as unaware
        (``stale_after_s``), then the limit is 0 (``stop_after_s``). Before the first update it is
        0 as well.

        Raises:
            NavError: a stamp that is not finite or lies before the last one.
        """
        now = self._checked_stamp(stamp_s)
        if self._latest_input is None:
            return NavConstraints(now, (), 0.0, "stale data: none yet", True)
        tracks, robot_state, seen = self._latest_input
        return self.update(tracks, robot_state, now, perception_stamp_s=seen)

    def _recovering(
        self, limit: GovernedSpeed, robot_state: RobotState, now: float, stale: bool
    ) -> tuple[GovernedSpeed, float | None]:
        """The limit under a ceiling that rises from stale data on, and that ceiling if any.

        The ceiling rises to the robot's maximum whatever the limit is meanwhile, so that more
        awareness never means less speed.
        """
        ceiling_mps, timing = self._ceiling_mps, self._policy.timing
        if self._latest is not None:
            elapsed_s = now - self._latest.stamp_s
            if elapsed_s > timing.stale_after_s:
                # Nobody has asked meanwhile: what was allowed before that counts no longer.
                ceiling_mps = min(self._latest.speed_limit_mps, abs(robot_state.speed_mps))
            if ceiling_mps is not None and not stale:
                credit_s = min(elapsed_s, timing.fresh_within_s)
                ceiling_mps += self._robot.max_acceleration_mps2 * credit_s
        if ceiling_mps is not None and limit.limit_mps > ceiling_mps:
            limit = replace(limit, limit_mps=ceiling_mps, limited_by="recovery after stale data")
        if stale:
            return limit, limit.limit_mps
        done = ceiling_mps is None or ceiling_mps >= self._robot.max_speed_mps
        return limit, (None if done else ceiling_mps)

    def _checked_stamp(self, stamp_s: float) -> float:
        now = finite_number("stamp_s", stamp_s, NavError)
        if self._latest is not None and now < self._latest.stamp_s:
            raise NavError(
                f"stamp_s must not go backward, got {now:.6f} s after {self._latest.stamp_s:.6f} s"
            )
        return now


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
