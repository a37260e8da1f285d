"""The adapter: turns person tracks into constraints for a local planner."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from perception.arrays import finite_number
from tracking import PersonTrack

from ._alert import Alert
from ._alerting import AlertHistory, alerts_due
from ._constraints import NavConstraints
from ._errors import NavError
from ._governor import GovernedSpeed, SpeedGovernor
from ._memory import PersonMemory
from ._obstacle_rules import ObstacleRules
from ._obstacles import obstacles_of
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState

# Tolerated difference between the clocks of two computers, or of a camera and a control loop.
_CLOCK_TOLERANCE_S = 0.05
# Positions, speeds and standard deviations beyond these are errors of whoever sent them. Beyond
# 1e15 m a circle's corners fall together.
_MOST_M = 1e12
_MOST_MPS = 1e4


class NavAdapter:
    """Turns tracked people into obstacles and a speed limit.

    A person's radius is that of the policy for the lower bound of α, plus ``uncertainty_sigmas``
    standard deviations of the position, and never below the floor (body radius plus minimum
    clearance). It grows at once. It shrinks at a bounded rate, to the largest radius that was
    called for in the last ``shrink_after_s``, and only with *new sightings* of a confirmed person:
    while no frame shows the person, neither repeated nor predicted tracks shrink the radius or
    raise the awareness.

    The speed limit is the smallest of all people and all rules: v_max of speed-and-separation
    monitoring with the human speed that the policy assumes, and the policy's other rules. The
    separation runs from the robot to the person's body circle (radius 0.30 m), not to the inflated
    obstacle. People whom the robot cannot reach while it stops limit it less (``docs/safety.md``).

    Tentative people, people unseen for longer than ``fresh_within_s`` and, with stale data, all
    people count as unaware. After stale data, or after a pause in the updates of that length, the
    limit rises from its last value no faster than the robot accelerates.

    Args:
        policy: radii, human speeds, margins and time behaviour.
        robot: footprint, braking and reaction time.

    Raises:
        NavError: for an argument of the wrong type, or a custom policy object whose values are not
            finite or grow with awareness.
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
        self._alert_history = AlertHistory()
        self._latest: NavConstraints | None = None
        self._latest_input: tuple[tuple[PersonTrack, ...], RobotState, float] | None = None
        # The ceiling of the limit during the recovery after stale data.
        self._ceiling_mps: float | None = None

    def update(
        self,
        tracks: Iterable[PersonTrack],
        robot_state: RobotState,
        stamp_s: float,
        *,
        perception_stamp_s: float | None = None,
    ) -> NavConstraints:
        """Return the constraints at ``stamp_s``.

        Args:
            tracks: the tracker's latest; they are predicted to ``stamp_s`` with constant velocity.
            robot_state: the latest; its age counts too.
            stamp_s: the present time, not before that of the previous update.
            perception_stamp_s: stamp of the latest frame that perception has processed, with or
                without people. If it is None, the newest track's stamp is used, and empty
                ``tracks`` mean that nobody is there. So only with this stamp does a dead camera
                stop a robot that sees nobody.

        Returns:
            Obstacles in the order of track ids, the speed limit with the rule that set it, and
            alerts, the most urgent first.

        Raises:
            NavError: for input of the wrong type or not finite, a position or standard deviation
                beyond 1e12 m, a speed beyond 10 km/s, an id that occurs twice, a stamp before the
                last one, or data from the future. After this or any other error the adapter is as
                it was before the call.
        """
        now = self._checked_stamp(stamp_s)
        current = _checked_tracks(tracks, now)
        if not isinstance(robot_state, RobotState):
            raise NavError(f"robot_state must be a RobotState, got {type(robot_state).__name__}")
        robot_age_s = _age_s("robot_state.stamp_s", robot_state.stamp_s, now)
        if perception_stamp_s is not None:
            perceived_s = finite_number("perception_stamp_s", perception_stamp_s, NavError)
        else:
            perceived_s = min(now, max((track.stamp_s for track in current), default=now))
        perception_age_s = _age_s("perception_stamp_s", perceived_s, now)

        timing = self._policy.timing
        stale = max(robot_age_s, perception_age_s) > timing.stale_after_s
        people = self._people
        if self._latest is not None and now - self._latest.stamp_s > timing.stale_after_s:
            # After a pause in the updates nobody counts as aware any more.
            people = self._rules.after_silence(people)
        people = self._rules.updated(people, current, now, stale)
        _refuse_absurd(people)
        limit = self._governor.limit(people, robot_state, now, robot_age_s)
        for name, age_s in (("perception", perception_age_s), ("robot state", robot_age_s)):
            if age_s > timing.stop_after_s:
                reason = f"stale data: {name} is {age_s:.2f} s old"
                limit = replace(limit, limit_mps=0.0, limited_by=reason)
        limit, ceiling_mps = self._limit_recovery(limit, robot_state, now, stale)
        alerts: tuple[Alert, ...] = ()
        alert_history = self._alert_history
        if self._policy.alerts is not None and not stale:
            alerts, alert_history = alerts_due(
                self._policy.alerts,
                self._robot,
                people,
                robot_state,
                now,
                self._policy.margins.uncertainty_sigmas,
                alert_history,
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
        # Nothing can fail from here on. An error above leaves the adapter unchanged.
        self._people = people
        self._alert_history = alert_history
        self._latest = constraints
        self._latest_input = current, robot_state, perceived_s
        self._ceiling_mps = ceiling_mps
        return constraints

    def watchdog(self, stamp_s: float) -> NavConstraints:
        """Return the constraints at ``stamp_s`` without new input: :meth:`update` with the latest.

        For a timer beside the callbacks that call :meth:`update`. After ``stale_after_s`` everyone
        counts as unaware, and after ``stop_after_s`` the limit is 0. Before the first update it is
        0 too.

        Raises:
            NavError: for a stamp that is not finite or lies before the last one.
        """
        now = self._checked_stamp(stamp_s)
        if self._latest_input is None:
            return NavConstraints(now, (), 0.0, "stale data: none yet", True)
        tracks, robot_state, perceived_s = self._latest_input
        return self.update(tracks, robot_state, now, perception_stamp_s=perceived_s)

    def _limit_recovery(
        self, limit: GovernedSpeed, robot_state: RobotState, now: float, stale: bool
    ) -> tuple[GovernedSpeed, float | None]:
        """Return the limit under the recovery ceiling, and the ceiling, or None without one.

        There is a ceiling from stale data on. It rises to the robot's maximum whatever the limit is
        meanwhile, so that more awareness never means less speed.
        """
        ceiling_mps, timing = self._ceiling_mps, self._policy.timing
        if self._latest is not None:
            elapsed_s = now - self._latest.stamp_s
            if elapsed_s > timing.stale_after_s:
                # After a pause in the updates the robot may be slower than the limit before it.
                ceiling_mps = min(self._latest.speed_limit_mps, abs(robot_state.speed_mps))
            if ceiling_mps is not None and not stale:
                counted_s = min(elapsed_s, timing.fresh_within_s)
                ceiling_mps += self._robot.max_acceleration_mps2 * counted_s
        if ceiling_mps is not None and limit.limit_mps > ceiling_mps:
            limit = replace(limit, limit_mps=ceiling_mps, limited_by="recovery after stale data")
        if stale:
            return limit, limit.limit_mps
        done = ceiling_mps is None or ceiling_mps >= self._robot.max_speed_mps
        return limit, (None if done else ceiling_mps)

    def _checked_stamp(self, stamp_s: float) -> float:
        """Return the stamp after checking that it is finite and does not go back."""
        now = finite_number("stamp_s", stamp_s, NavError)
        if self._latest is not None and now < self._latest.stamp_s:
            raise NavError(
                f"stamp_s must not go backward, got {now:.6f} s after {self._latest.stamp_s:.6f} s"
            )
        return now


def _age_s(name: str, stamp_s: float, now: float) -> float:
    """Return the age of data, at least 0; refuse data from the future."""
    if stamp_s > now + _CLOCK_TOLERANCE_S:
        raise NavError(
            f"{name} must not lie after stamp_s, got {stamp_s:.6f} s and {now:.6f} s "
            f"(tolerance {_CLOCK_TOLERANCE_S:g} s)"
        )
    return max(0.0, now - stamp_s)


def _checked_tracks(tracks: Iterable[PersonTrack], now: float) -> tuple[PersonTrack, ...]:
    """Return the tracks after checking their types, ids and stamps."""
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


def _refuse_absurd(people: Mapping[int, PersonMemory]) -> None:
    """Refuse people whose finite numbers are too large for any person."""
    for track_id, person in people.items():
        x_m, y_m = person.position_odom_m
        vx_mps, vy_mps = person.velocity_odom_mps
        place_m, speed_mps = max(abs(x_m), abs(y_m)), max(abs(vx_mps), abs(vy_mps))
        # A NaN, which an overflow may leave, fails the comparison too.
        for name, value, most, unit in (
            ("position_odom_m", place_m, _MOST_M, "m"),
            ("velocity_odom_mps", speed_mps, _MOST_MPS, "m/s"),
            ("the standard deviation of covariance_odom", person.sigma_m, _MOST_M, "m"),
        ):
            if not value <= most:
                raise NavError(
                    f"track {track_id}: {name} must be at most {most:g} {unit}, got {value:g}"
                )
