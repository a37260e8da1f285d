"""People who are lost: they go on limiting the speed for a while, less and less."""

from __future__ import annotations

from collections.abc import Mapping

from ._constraints import GovernedSpeed
from ._governor import SpeedGovernor
from ._memory import LostPerson, PersonMemory
from ._obstacle_rules import ObstacleRules
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState


class LostPeople:
    """Rules for the speed near the places of lost people. The caller keeps the people.

    A tracker gives somebody up when they have been out of sight for long, which is when least is
    known of them. The limit that such a person sets rises from then on by ``lost_rise_mps2``. It is
    never lower than if the person were still held, so a robot that has passed them is free. Lost
    people have no obstacles. Nobody is lost whose place a sensor has shown empty
    (:attr:`~tracking.PersonTrack.place_empty`).

    Args:
        policy: time behaviour.
        robot: its maximum speed.
        rules: how people move who are missing.
        governor: the limit that each of them sets.
    """

    def __init__(
        self,
        policy: AwarenessPolicy,
        robot: RobotProfile,
        rules: ObstacleRules,
        governor: SpeedGovernor,
    ) -> None:
        self._rise_mps2 = policy.timing.lost_rise_mps2
        self._hold_s = policy.timing.hold_s
        self._maximum_mps = robot.max_speed_mps
        self._rules = rules
        self._governor = governor

    def missing(
        self,
        lost: Mapping[int, LostPerson],
        before: Mapping[int, PersonMemory],
        before_s: float | None,
        people: Mapping[int, PersonMemory],
        now: float,
    ) -> dict[int, LostPerson]:
        """Return all lost people as of ``now``; nobody who is there is lost.

        Args:
            lost: of the update before.
            before: people of the update before.
            before_s: its stamp, or None if there was none.
            people: who are there now.
            now: stamp of the update.
        """
        if self._rise_mps2 is None or before_s is None:
            return {}
        missing = {track_id: person for track_id, person in lost.items() if track_id not in people}
        for track_id in [each for each in before if each not in people]:
            memory = before[track_id]
            if not memory.was_confirmed or memory.track.place_empty:
                continue
            # After a pause in the updates they have been lost for some time.
            since_s = min(max(memory.seen_stamp_s + self._hold_s, before_s), now)
            missing[track_id] = LostPerson(memory, since_s)
        return {
            track_id: person._replace(memory=self._rules.missing_person(person.memory, now))
            for track_id, person in missing.items()
        }

    def limited(
        self,
        limit: GovernedSpeed,
        lost: Mapping[int, LostPerson],
        robot_state: RobotState,
        now: float,
        robot_age_s: float,
    ) -> tuple[GovernedSpeed, dict[int, LostPerson]]:
        """Return a limit, lowered for the lost people, and those of them who still count.

        Args:
            limit: for the people who are there.
            lost: as of ``now``.
            robot_state: the latest.
            now: stamp of the update.
            robot_age_s: age of ``robot_state``.
        """
        if not lost or self._rise_mps2 is None:
            return limit, {}
        memories = {track_id: person.memory for track_id, person in lost.items()}
        limits_mps = self._governor.limits_mps(memories, robot_state, now, robot_age_s)
        kept = {}
        for (track_id, person), own_mps in zip(lost.items(), limits_mps, strict=True):
            first_mps = own_mps if person.limit_mps is None else person.limit_mps
            ceiling_mps = first_mps + self._rise_mps2 * (now - person.since_s)
            if ceiling_mps >= self._maximum_mps:
                continue
            kept[track_id] = person._replace(limit_mps=first_mps)
            allowed_mps = max(own_mps, ceiling_mps)
            limit = limit.at_most(allowed_mps, f"track {track_id}: lost")
        return limit, kept
