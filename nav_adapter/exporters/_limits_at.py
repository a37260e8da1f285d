"""The limits of all people and rules at many poses at once, and who sets them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from .._constraints import NavConstraints
from .._errors import NavError
from .._people_ahead import PersonAhead, people_ahead
from .._robot import LATERAL_NOISE_MPS, RobotProfile
from .._speed_basis import SpeedBasis
from ._courses import Value, chosen_of, courses_of, stands_at
from ._reach_field import Field, Reaches


def limits_at(
    constraints: NavConstraints,
    positions_m: FloatArray,
    headings_rad: FloatArray | None,
    velocities_mps: tuple[FloatArray, Value] | None,
    yaw_rates_radps: Value,
    times_s: FloatArray,
    aware_for_s: float,
    reach_m: float = 0.0,
    fine: bool = False,
) -> tuple[FloatArray, NDArray[np.intp], list[str]]:
    """Return the limits (K, T) at poses (K, T, …), and who sets them: indices of texts.

    Args:
        constraints: of ``NavAdapter.update``, or some that stop the robot.
        positions_m: (K, T, 2).
        headings_rad: (K, T), or None for any.
        velocities_mps: forward and left, (K, T), or None for a robot that drives forwards.
        yaw_rates_radps: (K, T), or 0.
        times_s: (T,) after the stamp.
        aware_for_s: how long awareness counts.
        reach_m: the limits hold within this distance of the poses; they have no heading then.
        fine: all steps of time are as short as the shortest of ``update``.

    Raises:
        NavError: for constraints that do not come from ``update`` unless they stop the robot.
    """
    if not isinstance(constraints, NavConstraints):
        raise NavError(f"constraints must be NavConstraints, got {type(constraints).__name__}")
    basis, robot = constraints.speed_basis, constraints.robot
    shape = positions_m.shape[:2]
    by = np.zeros(shape, dtype=np.intp)
    if basis is None or robot is None:
        if constraints.speed_limit_mps > 0.0:
            raise NavError(
                "constraints must come from NavAdapter.update, got some without speed_basis"
            )
        return np.zeros(shape), by, [constraints.limited_by]
    if basis.stopped:
        return np.zeros(shape), by, ["stale data"]
    texts = [
        "recovery after stale data",
        "robot: moves sideways, but its profile says otherwise",
        "robot maximum",
    ]
    limits, by = np.full(shape, robot.max_speed_mps), by + 2
    if basis.ceiling_mps is not None:
        rise_mps2 = 0.0 if constraints.stale else robot.max_acceleration_mps2
        ceilings = np.broadcast_to(basis.ceiling_mps + rise_mps2 * times_s, shape)
        by[ceilings < limits] = 0
        limits = np.minimum(limits, ceilings)
    if velocities_mps is not None and robot.moves_sideways is False:
        sideways = np.broadcast_to(np.abs(velocities_mps[1]) > LATERAL_NOISE_MPS, shape)
        limits[sideways], by[sideways] = 0.0, 1
    people = tuple(people_ahead(constraints, times_s, aware_for_s))
    if not people or not limits.size:
        return limits, by, texts
    lowest, who = limits.reshape(-1), np.full(limits.size, -1)
    told = positions_m, headings_rad, velocities_mps, yaw_rates_radps
    _lower(lowest, who, people, robot, basis, told, reach_m, fine)
    by = np.where(who.reshape(shape) < 0, by, who.reshape(shape) + len(texts))
    for person in people:
        rules = ("reach", "in the path") if person.least_mps is None else ("lost", "lost")
        texts += [f"track {person.track_id}: {rule}" for rule in rules]
    return lowest.reshape(shape), by, texts


def _lower(
    lowest: FloatArray,
    who: NDArray[np.intp],
    people: tuple[PersonAhead, ...],
    robot: RobotProfile,
    basis: SpeedBasis,
    told: tuple[FloatArray, FloatArray | None, tuple[FloatArray, Value] | None, Value],
    reach_m: float,
    fine: bool,
) -> None:
    """Lower limits (K·T,) in place to those that people set, and write down by whom.

    What is told of the robot are the arguments of :func:`limits_at`, in their order.
    """
    positions_m, headings_rad, velocities_mps, yaw_rates_radps = told
    count = positions_m.shape[1]

    def flat(value: Value) -> Value:
        is_array = isinstance(value, np.ndarray) and value.ndim
        return value.reshape(-1, *value.shape[2:]) if is_array else value

    places, headings, rates = map(flat, (positions_m, headings_rad, yaw_rates_radps))
    velocities = velocities_mps and tuple(map(flat, velocities_mps))
    times = np.tile(np.arange(count), positions_m.shape[0])
    reaches = Reaches.of(people, count, basis, robot)
    walkers = [index for index, person in enumerate(people) if person.walks_faster]
    # As in the adapter: whoever walks on is not met by a robot that goes straight on.
    on = tuple(people[index].walking_on() for index in walkers)
    walking = Reaches.of(on, count, basis, robot) if on else None
    standing = np.zeros(lowest.size, dtype=bool)
    if velocities and headings_rad is not None and robot.moves_sideways is not False:
        standing |= stands_at(*velocities)
    for anywhere in (False, True):
        poses = np.flatnonzero(standing == anywhere)
        if not len(poses):
            continue
        here, heading, rate = (chosen_of(each, poses) for each in (places, headings, rates))
        velocity = velocities and tuple(chosen_of(each, poses) for each in velocities)
        courses = courses_of(robot, basis, here, heading, velocity, rate, anywhere)
        given = times[poses], basis, robot, reach_m, fine
        some = lowest[poses]
        first = Field(reaches, courses, *given).lower(some)
        if walking is not None:
            second = Field(walking, courses.straight_on(), *given, walking_on=True).lower(some)
            first = np.where(second < 0, first, 2 * np.array(walkers)[second // 2])
        who[poses], lowest[poses] = first, some
