"""The adapter: turns person tracks into constraints for a local planner."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from perception.arrays import FloatArray, finite_number
from tracking import PersonTrack
from tracking.clock import Entry, Gate
from tracking.prediction import PredictionModel

from ._asking import Addressed, AddressHistory, Addressing
from ._checks import age_of_s, checked_tracks, goes_back, require_type
from ._constraints import NavConstraints, PersonObstacle
from ._errors import NavError
from ._governor import GovernedSpeed, SpeedGovernor
from ._known import SpeedBasis
from ._people import People, Person
from ._policy import AwarenessPolicy
from ._robot import LATERAL_NOISE_MPS, RobotProfile, RobotState
from .course import stands_still
from .rigid import Motion
from .rules import Sectors, seen_sectors

_LOG = logging.getLogger("nav_adapter")
# A stamp that is later than the last one by more than this may be wrong.
_MAX_PAUSE_S: Final = 10.0


@dataclass(frozen=True, slots=True)
class _Memory:
    """The adapter's memory of its last update.

    ``people`` are everybody, those who were dropped and still limit the speed included. ``given``
    are tracks, state of the robot, stamp of perception, and what was seen when. The limit has a
    ceiling during the recovery after stale data. If ``silent``, people count as after a pause.
    """

    people: tuple[Person, ...] = ()
    addressed: AddressHistory = field(default_factory=AddressHistory)
    constraints: NavConstraints | None = None
    given: tuple[tuple[PersonTrack, ...], RobotState, float, Sectors] | None = None
    ceiling_mps: float | None = None
    silent: bool = False

    @property
    def stamp_s(self) -> float | None:
        """Stamp of the last update."""
        return None if self.constraints is None else self.constraints.stamp_s


class NavAdapter:
    """Turns tracked people into obstacles and a speed limit.

    A person's radius is that of the policy for the lower bound of α, or the smallest beside which
    the limit is usable (:func:`nav_adapter.limit.passing_radius_m`), plus ``uncertainty_sigmas``
    standard deviations of the position. It grows at once. It shrinks at a bounded rate, and only
    with *new sightings* of a confirmed person: while no frame shows the person, neither repeated
    nor predicted tracks shrink the radius or raise the awareness.

    The speed limit is the lowest of all people: the highest speed at which the robot stands before
    it meets their reach (:mod:`nav_adapter.limit`), with the speed that the policy assumes for
    their awareness, and never more than a protective field along the robot's own curve allows.

    When a person is dropped whom no sensor has shown to be gone, the limit that they set rises
    slowly (``lost_rise_mps2``).

    Tentative people, people unseen for longer than ``fresh_within_s`` and, with stale data, all
    people count as unaware. For the speed limit, so do people at first sight, until frames have
    shown them for 0.2 s. An id at a place that the person could not have reached is first sight
    too: a tracker may have exchanged ids. After stale data, or after a pause in the updates of that
    length, the limit rises from its last value no faster than the robot accelerates.

    A stamp that goes back, or that runs 10 s ahead of the robot's state, is refused and counted.
    When such stamps go on for 1 s, the clock has been set: the adapter forgets
    all people, starts anew and logs a warning (logger ``nav_adapter``). If the clock returns after
    a single update far ahead, the adapter goes on from before that update.

    Examples:
        >>> from nav_adapter import AwarenessPolicy, NavAdapter, RobotProfile, RobotState
        >>> box_m = [[0.4, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.4, -0.3]]
        >>> robot = RobotProfile(box_m, 1.5, 1.0, 1.0, reaction_time_s=0.3)
        >>> adapter = NavAdapter(AwarenessPolicy.preset("balanced"), robot)
        >>> now = RobotState(0.0, [0.0, 0.0], 0.0, speed_mps=0.5, yaw_rate_radps=0.0)
        >>> adapter.update((), now, 0.0).limited_by  # in place of (): a tracker's tracks
        'robot maximum'

    Args:
        policy: radii, human speeds, margins and time behaviour.
        robot: footprint, braking and reaction time.
        prediction: of speed field and alerts; None: as certain as the present.

    Raises:
        NavError: for an argument of the wrong type, or a custom policy object whose values are not
            finite or grow with awareness.
    """

    def __init__(
        self,
        policy: AwarenessPolicy,
        robot: RobotProfile,
        *,
        prediction: PredictionModel | None = None,
    ) -> None:
        require_type("policy", policy, AwarenessPolicy)
        require_type("robot", robot, RobotProfile)
        require_type("prediction", prediction, PredictionModel | None)
        self._policy = policy
        self._prediction = prediction
        self.use_robot(robot)
        self._memory = _Memory()
        # As of the latest watchdog since then. No update knows of it.
        self._watched: _Memory | None = None
        self._gate: Gate[_Memory] = Gate(_MAX_PAUSE_S)
        self._warned_of_drive = False

    @property
    def refused_stamps(self) -> int:
        """Number of updates that were refused, or discarded later, for their stamp."""
        return self._gate.late.total() + self._gate.ahead.total()

    @property
    def clock_restarts(self) -> int:
        """Number of times the adapter has started anew because the clock had been set."""
        return self._gate.restarts

    def reset(self) -> None:
        """Forget all people and the clock. The limit then rises from its last value."""
        latest = self._memory.constraints
        ceiling_mps = self._memory.ceiling_mps if latest is None else latest.speed_limit_mps
        self._memory, self._watched = _Memory(ceiling_mps=ceiling_mps), None
        self._gate.forget()

    def use_robot(self, robot: RobotProfile) -> None:
        """Go on with another profile, as of a robot that takes or leaves a load; people are kept.

        The next update has its limit. A footprint that grows must be given before the robot moves.

        Raises:
            NavError: for anything else.
        """
        require_type("robot", robot, RobotProfile)
        self._robot = robot
        self._people = People(self._policy, robot)
        self._governor = SpeedGovernor(self._policy, robot)
        self._addressing = Addressing(self._policy, robot, self._governor, self._prediction)

    def update(
        self,
        tracks: Iterable[PersonTrack],
        robot_state: RobotState,
        stamp_s: float,
        *,
        perception_stamp_s: float | None = None,
        seen_stamp_s: Callable[[float, float], float | None] | None = None,
    ) -> NavConstraints:
        """Return the constraints at ``stamp_s``.

        Args:
            tracks: the tracker's latest; they are predicted to ``stamp_s`` with constant velocity.
            robot_state: the latest; its age counts too.
            stamp_s: the present time, not before that of the previous update, and at most 10 s
                after it unless ``robot_state`` is as new.
            perception_stamp_s: stamp of the latest frame that perception has processed, with or
                without people. If it is None, the newest track's stamp is used, and empty
                ``tracks`` mean that no person is there. So a dead camera stops a robot without
                tracks only if this stamp is given.
            seen_stamp_s: gives, for a bearing from the base and half the width of a sector (rad),
                the stamp from which all of it has been seen, or None if not all of it has been,
                such as ``SeenDirections.stamp_s``. The robot then creeps where no sensor has
                looked lately. None: it is not known what the sensors see, and all counts as seen.

        Returns:
            Obstacles in the order of track ids, the speed limit with the rule that set it, and
            alerts: warnings, the most urgent first, then a request for attention.

        Raises:
            NavError: for input of the wrong type or not finite, a position or standard deviation
                beyond 1e12 m, a speed beyond 10 km/s, an id that is negative or occurs twice, a
                stamp that jumps, or data from the future. After this or any other error the adapter
                is as it was before the call, but for :attr:`refused_stamps`.
        """
        now = finite_number("stamp_s", stamp_s, NavError)
        current = checked_tracks(tracks)
        require_type("robot_state", robot_state, RobotState)
        entry = self._entry(now, robot_state)
        perceived_s = self._perceived_s(current, now, perception_stamp_s)
        given = current, robot_state, perceived_s, seen_sectors(seen_stamp_s)
        memory = self._following(entry.memory, *given, now)
        # Nothing can fail from here on. An error above leaves the adapter unchanged.
        if entry.anew:
            last_s = self._memory.stamp_s
            _LOG.warning(
                "the clock has been set: %.3f s after %.3f s; the adapter starts anew", now, last_s
            )
        self._memory, self._watched = memory, None
        self._gate.taken(entry)
        self._warn_of_drive(robot_state)
        assert memory.constraints is not None
        return memory.constraints

    def watchdog(self, stamp_s: float) -> NavConstraints:
        """Return the constraints at ``stamp_s`` without new input: :meth:`update` with the latest.

        For a timer beside the callbacks that call :meth:`update`. After ``stale_after_s`` everyone
        counts as unaware, and after ``stop_after_s`` the limit is 0. Before the first update it is
        0 too. Alerts and answers are those of :meth:`update` alone: here there are none, and no
        call changes what :meth:`update` returns later.

        Raises:
            NavError: for a stamp that is not finite or lies before the last one.
        """
        now = finite_number("stamp_s", stamp_s, NavError)
        before = self._watched or self._memory
        if before.given is None or before.stamp_s is None:
            return NavConstraints(now, (), 0.0, "stale data: none yet", True, robot=self._robot)
        if now < before.stamp_s:
            raise NavError(goes_back(now, before.stamp_s))
        memory = self._following(before, *before.given, now, addresses=False)
        assert memory.constraints is not None
        if now - before.stamp_s <= self._policy.timing.stale_after_s:
            # A stamp farther ahead may be wrong, and must not make all later ones late.
            self._watched = memory
        return memory.constraints

    def _entry(self, now: float, robot_state: RobotState) -> Entry[_Memory]:
        """Return how an update at ``now`` is taken, with the memory that it follows.

        Raises:
            NavError: for a stamp that jumps. Only then the adapter changes: it counts the stamp.
        """
        memory, leap, latest = self._memory, self._gate.leap, self._memory.constraints
        if latest is None:
            return Entry(memory, now)
        pause_s = now - latest.stamp_s
        if 0.0 <= pause_s <= self._policy.timing.stale_after_s:
            refused_s = self._gate.refused_for_s(now, self._policy.timing.stale_after_s)
            if refused_s > 0.5 * self._policy.timing.fresh_within_s:
                # A clock that was set back a little has just caught up. The tracker cannot tell the
                # frames since then from late ones: their people may still have the awareness that
                # they had before.
                memory = replace(memory, silent=True)
            return Entry(memory, now)
        if pause_s >= 0.0 and min(pause_s, now - robot_state.stamp_s) <= _MAX_PAUSE_S:
            # A pause of the caller, as it seems.
            return Entry(memory, now, leaps=True)
        if pause_s < 0.0 and leap is not None:
            earlier_s = leap.memory.stamp_s
            if earlier_s is not None and 0.0 <= now - earlier_s <= _MAX_PAUSE_S:
                return Entry(leap.memory, now, undone=leap)
        anew = _Memory(ceiling_mps=min(robot_state.travel_mps, latest.speed_limit_mps))
        entry = self._gate.new_clock(anew, now, ahead=pause_s >= 0.0)
        if entry is not None:
            return entry
        if pause_s < 0.0:
            raise NavError(goes_back(now, latest.stamp_s))
        raise NavError(
            f"stamp_s jumps ahead, got {now:.6f} s after {latest.stamp_s:.6f} s, with a "
            f"robot_state of {robot_state.stamp_s:.6f} s (at most {_MAX_PAUSE_S:g} s)"
        )

    @staticmethod
    def _perceived_s(
        current: tuple[PersonTrack, ...], now: float, perception_stamp_s: float | None
    ) -> float:
        """Return the stamp of the latest frame of perception, after checking the input's ages."""
        stamps = [track.stamp_s for track in current] or [now]
        for stamp_s in (min(stamps), max(stamps)):
            age_of_s(f"tracks[{stamps.index(stamp_s)}].stamp_s", stamp_s, now)
        if perception_stamp_s is not None:
            return finite_number("perception_stamp_s", perception_stamp_s, NavError)
        return min(now, max(stamps))

    def _following(
        self,
        before: _Memory,
        current: tuple[PersonTrack, ...],
        robot_state: RobotState,
        perceived_s: float,
        seen_s: Sectors,
        now: float,
        *,
        addresses: bool = True,
    ) -> _Memory:
        """Return the memory after an update, with its constraints. Changes nothing.

        It warns and asks people only if it ``addresses`` them.
        """
        robot_age_s = age_of_s("robot_state.stamp_s", robot_state.stamp_s, now)
        perception_age_s = age_of_s("perception_stamp_s", perceived_s, now)
        timing = self._policy.timing
        stale = max(robot_age_s, perception_age_s) > timing.stale_after_s
        pause_s = 0.0 if before.stamp_s is None else now - before.stamp_s
        # After a pause in the updates nobody counts as aware any more.
        silent = before.silent or pause_s > timing.stale_after_s
        everybody = self._people.follow(
            before.people, current, now, before.stamp_s, stale=stale, silent=silent
        )
        people = {person.id: person for person in everybody if not person.is_lost}
        lost = {person.id: person for person in everybody if person.is_lost}
        limit, lost = self._governor.limit(people, lost, robot_state, now, robot_age_s, seen_s)
        for name, age_s in (("perception", perception_age_s), ("robot state", robot_age_s)):
            if age_s > timing.stop_after_s:
                limit = limit.stopped(f"stale data: {name} is {age_s:.2f} s old")
        if problem := self._drive_problem(robot_state):
            limit = limit.stopped(problem)
        limit, ceiling_mps = self._limit_recovery(before, limit, robot_state, pause_s, stale)
        addressed = Addressed((), (), before.addressed, people)
        if addresses and not stale:
            addressed = self._addressing.step(
                before.addressed, people, limit, robot_state, now, robot_age_s
            )
        people = addressed.people
        braked_mps = _latest_travel_mps(before, robot_state)
        braked_mps -= self._robot.max_deceleration_mps2 * pause_s
        stands = stands_still(Motion.of(robot_state))
        constraints = NavConstraints(
            stamp_s=now,
            obstacles=_obstacles_of(people.values(), now),
            speed_limit_mps=limit.limit_mps,
            limited_by=limit.limited_by,
            stale=stale,
            reachable_speed_limit_mps=max(limit.limit_mps, braked_mps),
            alerts=addressed.alerts,
            answers=addressed.answers,
            braking_suffices=limit.braking_suffices,
            fastest_point_limit_mps=limit.fastest_point_mps,
            robot=self._robot,
            other_way_limit_mps=limit.other_way_mps,
            speed_basis=SpeedBasis(
                *(now, self._policy, people, lost, current, robot_age_s, perception_age_s),
                *(ceiling_mps, self._prediction, seen_s),
                None if stands else (robot_state.speed_mps, robot_state.lateral_mps),
            ),
        )
        return _Memory(
            (*people.values(), *lost.values()),
            addressed.history,
            constraints,
            (current, robot_state, perceived_s, seen_s),
            ceiling_mps,
        )

    def _limit_recovery(
        self,
        before: _Memory,
        limit: GovernedSpeed,
        robot_state: RobotState,
        pause_s: float,
        stale: bool,
    ) -> tuple[GovernedSpeed, float | None]:
        """Return the limit under the recovery ceiling, and the ceiling, or None without one.

        There is a ceiling from stale data on. It rises to the robot's maximum whatever the limit is
        meanwhile, so that more awareness never means less speed.
        """
        ceiling_mps, timing = before.ceiling_mps, self._policy.timing
        if before.constraints is not None:
            if pause_s > timing.stale_after_s:
                # After a pause in the updates the robot may be slower than the limit before it.
                ceiling_mps = min(before.constraints.speed_limit_mps, robot_state.travel_mps)
            if ceiling_mps is not None and not stale:
                counted_s = min(pause_s, timing.fresh_within_s)
                ceiling_mps += self._robot.max_acceleration_mps2 * counted_s
        if ceiling_mps is not None:
            limit = limit.at_most(ceiling_mps, "recovery after stale data")
        if stale:
            return limit, limit.limit_mps
        done = ceiling_mps is None or ceiling_mps >= self._robot.max_speed_mps
        return limit, (None if done else ceiling_mps)

    def _drive_problem(self, robot_state: RobotState) -> str:
        """Return in words that a robot moves sideways that cannot, by its profile; else nothing."""
        lateral_mps, robot = abs(robot_state.lateral_mps), self._robot
        if robot.moves_sideways is not False or lateral_mps <= LATERAL_NOISE_MPS:
            return ""
        return (
            f"robot: moves sideways at {lateral_mps:.2f} m/s, but its profile says "
            f"drive={robot.drive!r}"
        )

    def _warn_of_drive(self, robot_state: RobotState) -> None:
        """Log lateral motion of a robot that has none, once until it ends."""
        problem = self._drive_problem(robot_state)
        if problem and not self._warned_of_drive:
            _LOG.warning("%s: the speed limit is 0", problem)
        self._warned_of_drive = bool(problem)


def _latest_travel_mps(before: _Memory, robot_state: RobotState) -> float:
    """Return the robot's speed at the last update, as far as braking since then may have gone.

    A state that repeats says nothing new: the robot has braked since its stamp.
    """
    if before.constraints is None or before.given is None:
        return robot_state.travel_mps
    if robot_state.stamp_s > before.given[1].stamp_s:
        return robot_state.travel_mps
    return min(robot_state.travel_mps, before.constraints.reachable_speed_limit_mps)


def _obstacles_of(people: Collection[Person], now: float) -> tuple[PersonObstacle, ...]:
    """Return one obstacle per person, in the order of ``people``."""
    if not people:
        return ()
    centers = np.array([person.position_odom_m for person in people])
    # The rows become the obstacles' read-only centres.
    centers.setflags(write=False)
    obstacles = []
    for person, center, covariance in zip(
        people, centers, _covariances_at(people, now), strict=True
    ):
        # The adapter's own numbers need no checks, which take four times as long as the rest.
        obstacle = object.__new__(PersonObstacle)
        obstacle.__dict__.update(
            track_id=person.id,
            center_odom_m=center,
            velocity_odom_mps=person.track.velocity_odom_mps,
            radius_m=person.radius_m,
            height_m=person.track.height_m,
            awareness_lower=person.awareness_lower,
            covariance_odom=covariance,
        )
        obstacles.append(obstacle)
    return tuple(obstacles)


def _covariances_at(people: Collection[Person], now: float) -> FloatArray:
    """Return the covariances (N, 4, 4) of all tracks, predicted to ``now``; read-only."""
    covariances = np.array([person.track.covariance_odom for person in people])
    ages_s = [max(now - person.track.stamp_s, 0.0) for person in people]
    if any(ages_s):
        dt_s = np.array(ages_s)[:, None, None]
        # F P Fᵀ by blocks, F = [[I, dt I], [0, I]].
        covariances[:, :2] += dt_s * covariances[:, 2:]
        covariances[:, :, :2] += dt_s * covariances[:, :, 2:]
    covariances.setflags(write=False)
    return covariances
