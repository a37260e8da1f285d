"""People as the speed field needs them: numbers over time, in groups that need the same terms."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from perception.arrays import FloatArray

from .._memory import PersonMemory
from .._robot import RobotProfile
from .._speed_basis import SpeedBasis
from ._field_person import Foresight, PersonAhead, Reach


@dataclass(frozen=True, slots=True)
class PeopleAhead:
    """Some people at T times, all of whom need the same terms.

    Arrays are (N, T), or another shape of three axes that broadcasts with the poses.

    Attributes:
        track_ids: of the N people.
        x: predicted position relative to the reference point, in metres.
        y: the same.
        track_x: position of the track at its own stamp, which may be nearer; None where it is the
            predicted one for all of them.
        track_y: the same.
        margin_m: body radius and uncertainty of the position.
        reaction_s: the robot's reaction time and the age of the track.
        human_mps: assumed speed towards the robot, whatever the direction.
        velocity_x_mps: of the track; None where the direction of walking makes no difference.
        velocity_y_mps: the same.
        turn: cosine and sine of the turn towards the robot that counts, or None.
        start_delay_s: of people who stand, or None for people who walk at once.
        turn_delay_s: of people who have to turn to the robot, or None for people who turn at once.
        velocity_spread_mps: of the same.
        reserved: whether the start reserve can make a difference.
        lost_mps: limit that lost people allow at least, or None.
        reaches: of the N people.
    """

    track_ids: tuple[int, ...]
    x: Any
    y: Any
    track_x: Any
    track_y: Any
    margin_m: Any
    reaction_s: Any
    human_mps: Any
    velocity_x_mps: Any
    velocity_y_mps: Any
    turn: tuple[Any, Any] | None
    start_delay_s: Any
    turn_delay_s: Any
    velocity_spread_mps: Any
    reserved: bool
    lost_mps: Any
    reaches: tuple[Reach, ...]

    def mapped(self, change: Callable[[Any], Any]) -> PeopleAhead:
        """Return the people with ``change`` applied to each of their arrays."""
        arrays = {
            name: change(value) for name in _ARRAYS if (value := getattr(self, name)) is not None
        }
        turn = None if self.turn is None else (change(self.turn[0]), change(self.turn[1]))
        return replace(self, turn=turn, **arrays)


_ARRAYS: Final = (
    *("x", "y", "track_x", "track_y", "margin_m", "reaction_s", "human_mps"),
    *("velocity_x_mps", "velocity_y_mps", "start_delay_s", "lost_mps"),
    *("turn_delay_s", "velocity_spread_mps"),
)


class _Terms(NamedTuple):
    """Terms of the limit that a person needs. People who need the same ones are computed together.

    Attributes:
        aged: the track's position at its own stamp.
        direction: of walking.
        reserved: the start reserve.
        stands: time to start.
        turns: time to turn.
        lost: a limit that is allowed at least.
    """

    aged: bool
    direction: bool
    reserved: bool
    stands: bool
    turns: bool
    lost: bool


def people_ahead(
    basis: SpeedBasis,
    robot: RobotProfile,
    stamp_s: float,
    times_s: FloatArray,
    aware_for_s: float,
    reference_m: FloatArray,
    is_near: Callable[[FloatArray, FloatArray, float], bool],
) -> list[PeopleAhead]:
    """Return the people who may limit the speed, in groups.

    Args:
        basis: of the constraints.
        robot: likewise.
        stamp_s: of the constraints.
        times_s: (T,) after the stamp.
        aware_for_s: how long awareness counts.
        reference_m: (2,) the point that positions are relative to.
        is_near: whether a person in a box, given by two corners (2,), may limit a pose, given the
            distance between the centres from which on they do not.
    """
    shown = {track.id: track for track in basis.tracks}
    foresight = Foresight(basis.policy, stamp_s, times_s, aware_for_s, basis.prediction)
    groups: dict[_Terms, list[tuple[PersonAhead, Reach]]] = {}
    everyone = [(key, memory, None) for key, memory in basis.people.items()]
    for track_id, memory, lost_mps in (*everyone, *_lost(basis, stamp_s, times_s)):
        is_shown = lost_mps is None and shown.get(track_id) is memory.track
        person = foresight.person(track_id, memory, is_shown=is_shown, lost_mps=lost_mps)
        reach = person.reach(basis.policy, robot)
        free_m = reach.distance_m(robot.max_speed_mps)
        # People move straight on, so that the ends hold all places between them.
        if is_near(person.place_m[0], person.place_m[-1], free_m) or (
            person.is_aged and is_near(person.track_place_m[0], person.track_place_m[-1], free_m)
        ):
            groups.setdefault(_terms(basis, person), []).append((person, reach))
    # Those who need the most terms come last, when they lower the limit of few poses.
    return [
        _group(group, robot.reaction_time_s, reference_m, terms)
        for terms, group in sorted(groups.items(), key=lambda each: sum(each[0]))
    ]


def _terms(basis: SpeedBasis, person: PersonAhead) -> _Terms:
    """Return the terms that can make a difference for a person."""
    rules, least_mps = basis.policy.rules, person.least_mps
    stands = math.isfinite(person.start_delay_s)
    turns = math.isfinite(person.turn_delay_s)
    slower = least_mps < basis.policy.speed.human_speed_mps(0.0)
    reserved = rules.start_reserve is not None and (slower or stands)
    counts = rules.protective_field is None and person.walking_mps > least_mps
    direction = counts or turns or (reserved and person.walking_mps > 0.0)
    return _Terms(person.is_aged, direction, reserved, stands, turns, person.lost_mps is not None)


def _group(
    group: list[tuple[PersonAhead, Reach]],
    reaction_s: float,
    reference_m: FloatArray,
    terms: _Terms,
) -> PeopleAhead:
    def constant(values: list[float]) -> FloatArray:
        return np.array(values)[:, None]

    people = [person for person, _ in group]
    place_m = np.stack([each.place_m for each in people]) - reference_m
    track_m = np.stack([each.track_place_m for each in people]) - reference_m
    turns_rad = constant([each.turn_rad for each in people])
    turns = terms.direction and bool((turns_rad > 0.0).any())
    velocity_mps = np.array([each.velocity_mps for each in people])
    return PeopleAhead(
        track_ids=tuple(each.track_id for each in people),
        x=place_m[:, :, 0],
        y=place_m[:, :, 1],
        track_x=track_m[:, :, 0] if terms.aged else None,
        track_y=track_m[:, :, 1] if terms.aged else None,
        margin_m=_stacked([each.margin_m for each in people]),
        reaction_s=reaction_s + _stacked([each.age_s for each in people]),
        human_mps=_stacked([each.human_mps for each in people]),
        velocity_x_mps=velocity_mps[:, :1] if terms.direction else None,
        velocity_y_mps=velocity_mps[:, 1:] if terms.direction else None,
        turn=(np.cos(turns_rad), np.sin(turns_rad)) if turns else None,
        start_delay_s=constant([each.start_delay_s for each in people]) if terms.stands else None,
        turn_delay_s=constant([each.turn_delay_s for each in people]) if terms.turns else None,
        velocity_spread_mps=(
            constant([each.velocity_spread_mps for each in people]) if terms.turns else None
        ),
        reserved=terms.reserved,
        lost_mps=np.stack([np.asarray(each.lost_mps) for each in people]) if terms.lost else None,
        reaches=tuple(reach for _, reach in group),
    )


def _stacked(values: list[float | FloatArray]) -> FloatArray:
    """Return numbers of N people as (N, T), or (N, 1) if all are the same at all times."""
    if all(isinstance(each, float) for each in values):
        return np.array(values)[:, None]
    return np.stack(np.broadcast_arrays(*values))


def _lost(
    basis: SpeedBasis, stamp_s: float, times_s: FloatArray
) -> list[tuple[int, PersonMemory, FloatArray]]:
    """Return the lost people with the limit (T,) that each of them allows at least."""
    rise_mps2 = basis.policy.timing.lost_rise_mps2
    if rise_mps2 is None:
        return []
    return [
        (
            track_id,
            person.memory,
            (person.limit_mps or 0.0) + rise_mps2 * (stamp_s - person.since_s + times_s),
        )
        for track_id, person in basis.lost.items()
    ]
