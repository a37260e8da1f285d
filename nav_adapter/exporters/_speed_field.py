"""The speed limit at hypothetical poses and times."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from perception.arrays import FloatArray, finite_array, finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from .._known import SpeedBasis
from .._robot import LATERAL_NOISE_MPS, RobotProfile
from ..course import travel_bearing_rad
from ..rules import Unseen
from ._courses import Value, courses_at
from ._reach_field import Field, Reaches


def speed_limit_at(
    constraints: NavConstraints,
    positions_odom_m: Any,
    headings_odom_rad: Any = None,
    *,
    dt_s: float,
    first_s: float = 0.0,
    speeds_mps: Any = None,
    yaw_rates_radps: Any = None,
    aware_for_s: float = math.inf,
) -> Any:
    """Return (K, T), the speed limit in m/s at K × T poses, people moving as predicted.

    It is a lower bound of the limit that ``NavAdapter.update`` will give at that time to a robot
    that is there. All people count, and so do lost ones, the age of the data and the recovery after
    stale data. Without headings a circle about the robot counts, and people in every direction, so
    it may drive straight on, turn or stand. With headings but without speeds it drives forwards,
    and without yaw rates straight on.

    The bound holds if

    * people keep the velocity of their track, and those whom the latest frames show are seen as
      now: with the same covariance, the same age of the data, and the same awareness for as long
      as the track says;
    * people out of sight, and missing ones, are not seen again; the uncertainty of a track that
      coasts grows with its velocity's;
    * the tracker reports at least once per ``fresh_within_s``, and the adapter is updated as often;
    * the robot is no faster than its maximum.

    For people who stand and are seen, it is the limit itself within some millimetres per second,
    but for a few poses where a person just comes to the edge of the robot's way, or just not.

    Args:
        constraints: of ``NavAdapter.update``.
        positions_odom_m: (K, T, 2) of the robot's base; entry t is at ``first_s + t·dt_s`` after
            ``constraints.stamp_s``.
        headings_odom_rad: (K, T), or None for any.
        dt_s: > 0, time step.
        first_s: ≥ 0, time of the first entry.
        speeds_mps: (K, T) signed along the heading, or (K, T, 2) forward and left, or None.
        yaw_rates_radps: (K, T), or None.
        aware_for_s: ≥ 0, how long after the stamp awareness counts. People are unaware from then
            on, as they may have looked away.

    Raises:
        NavError: for an argument that is not finite, out of bounds or of a wrong shape, and for
            constraints that do not come from ``update`` unless they stop the robot.
    """
    positions = finite_array("positions_odom_m", positions_odom_m, ("K", "T", 2), NavError)
    shape = positions.shape[:2]
    dt = finite_number("dt_s", dt_s, NavError, minimum=0.0, exclusive_minimum=True)
    first = finite_number("first_s", first_s, NavError, minimum=0.0)
    if not aware_for_s >= 0.0:
        raise NavError(f"aware_for_s must be >= 0 s, got {aware_for_s!r:.80}")

    def of_shape(name: str, values: Any, *more: int) -> Any:
        return None if values is None else finite_array(name, values, (*shape, *more), NavError)

    headings = of_shape("headings_odom_rad", headings_odom_rad)
    rates = of_shape("yaw_rates_radps", yaw_rates_radps)
    velocities = None  # forward and to the left
    if np.ndim(speeds_mps) == 3:
        both = of_shape("speeds_mps", speeds_mps, 2)
        velocities = both[:, :, 0], both[:, :, 1]
    elif speeds_mps is not None:
        velocities = of_shape("speeds_mps", speeds_mps), np.float64(0.0)
    return limits_at(
        *(constraints, positions, headings, velocities, 0.0 if rates is None else rates),
        first + dt * np.arange(shape[1], dtype=np.float64),
        aware_for_s,
    )


def time_cost(
    constraints: NavConstraints,
    positions_odom_m: Any,
    headings_odom_rad: Any = None,
    *,
    dt_s: float,
    first_s: float = 0.0,
    speeds_mps: Any = None,
    yaw_rates_radps: Any = None,
    aware_for_s: float = math.inf,
    slowest_mps: float = 0.05,
) -> Any:
    """Return (K,), the seconds that a robot takes along K trajectories at the limits there.

    Each step counts with its length over the lower limit of its two ends. A robot that stands takes
    no time, so add what remains to the goal, for example the distance over the maximum speed.

    A limit below ``slowest_mps`` counts as that, so the cost is finite. With ``slowest_mps=0`` a
    trajectory through a place where the robot must stop costs infinite time.

    Args:
        constraints: as for :func:`speed_limit_at`, like the other arguments.
        positions_odom_m: (K, T, 2), T ≥ 2 for a cost above 0.
        headings_odom_rad: (K, T), or None.
        dt_s: > 0.
        first_s: ≥ 0.
        speeds_mps: (K, T), (K, T, 2) or None.
        yaw_rates_radps: (K, T), or None.
        aware_for_s: ≥ 0.
        slowest_mps: ≥ 0, least speed that counts.

    Raises:
        NavError: as :func:`speed_limit_at`.
    """
    slowest = finite_number("slowest_mps", slowest_mps, NavError, minimum=0.0)
    limits = speed_limit_at(
        constraints,
        positions_odom_m,
        headings_odom_rad,
        dt_s=dt_s,
        first_s=first_s,
        speeds_mps=speeds_mps,
        yaw_rates_radps=yaw_rates_radps,
        aware_for_s=aware_for_s,
    )
    steps = np.diff(np.asarray(positions_odom_m, dtype=np.float64), axis=1)
    lengths = np.hypot(steps[..., 0], steps[..., 1])
    slower = np.maximum(np.minimum(limits[:, 1:], limits[:, :-1]), slowest)
    seconds = np.full(lengths.shape, math.inf)
    np.divide(lengths, slower, out=seconds, where=slower > 0.0)
    return np.where(lengths > 0.0, seconds, 0.0).sum(axis=1)


def limits_at(
    constraints: NavConstraints,
    positions_m: FloatArray,
    headings_rad: FloatArray | None,
    velocities_mps: tuple[FloatArray, Value] | None,
    yaw_rates_radps: Value,
    times_s: FloatArray,
    aware_for_s: float,
    reach_m: float = 0.0,
) -> FloatArray:
    """Return the limits (K, T) at poses (K, T, …).

    Args:
        constraints: of ``NavAdapter.update``, or some that stop the robot.
        positions_m: (K, T, 2).
        headings_rad: (K, T), or None for any.
        velocities_mps: forward and left, (K, T), or None for a robot that drives forwards.
        yaw_rates_radps: (K, T), or 0.
        times_s: (T,) after the stamp.
        aware_for_s: how long awareness counts.
        reach_m: the limits hold within this distance of the poses; they have no heading then.

    Raises:
        NavError: for constraints that do not come from ``update`` unless they stop the robot.
    """
    if not isinstance(constraints, NavConstraints):
        raise NavError(f"constraints must be NavConstraints, got {type(constraints).__name__}")
    basis, robot = constraints.speed_basis, constraints.robot
    shape = positions_m.shape[:2]
    if basis is None or robot is None:
        if constraints.speed_limit_mps > 0.0:
            raise NavError(
                "constraints must come from NavAdapter.update, got some without speed_basis"
            )
        return np.zeros(shape)

    def flat(value: Value) -> Value:
        """Return values (K, T, …) as (K·T, …)."""
        is_array = isinstance(value, np.ndarray) and value.ndim
        return value.reshape(-1, *value.shape[2:]) if is_array else value

    velocities = velocities_mps and tuple(map(flat, velocities_mps))
    limits = np.tile(_without_people_mps(constraints, basis, robot, times_s), shape[0])
    if velocities is not None:
        _lower_by_direction(limits, velocities, basis, robot)
    known = list(basis.known_ahead(times_s, aware_for_s))
    if not known or not limits.size:
        return limits.reshape(shape)
    told = flat(positions_m), flat(headings_rad), velocities, flat(yaw_rates_radps)
    own = courses_at(robot, *told, basis.robot_age_s)
    turned = own.turned(np.float32(robot.turn_rad(basis.policy.reach.turn_deg)), np)
    reached = turned if basis.policy.applies("reach") else None
    field = (
        own.grown(basis.policy.margins.clearance_m) if basis.policy.applies("in the path") else None
    )
    given = np.tile(np.arange(shape[1]), shape[0]), basis, robot, reach_m
    Field(Reaches.of(known, basis, robot), reached, field, *given).lower(limits)
    walkers = [ahead for ahead in known if any(each.reach.may_walk_on for each in ahead)]
    if walkers and basis.policy.applies("walking on"):
        on = [
            [each._replace(reach=each.reach.walking_on(), first_sight_mps=0.0) for each in ahead]
            for ahead in walkers
        ]
        Field(Reaches.of(on, basis, robot), turned, None, *given).lower(limits)
    return limits.reshape(shape)


def _without_people_mps(
    constraints: NavConstraints, basis: SpeedBasis, robot: RobotProfile, times_s: FloatArray
) -> FloatArray:
    """Return the limits (T,) by the robot's maximum, old data and the recovery after them."""
    if basis.stopped:
        return np.zeros(len(times_s))
    limits = np.full(len(times_s), robot.max_speed_mps)
    if basis.ceiling_mps is not None:
        rise_mps2 = 0.0 if constraints.stale else robot.max_acceleration_mps2
        limits = np.minimum(limits, basis.ceiling_mps + rise_mps2 * times_s)
    return limits


def _lower_by_direction(
    limits: FloatArray,
    velocities_mps: tuple[Value, ...],
    basis: SpeedBasis,
    robot: RobotProfile,
) -> None:
    """Lower limits (N,) in place where the drive, or what sensors see, forbids the direction."""
    forward, left = velocities_mps
    if robot.moves_sideways is False:
        limits[np.broadcast_to(np.abs(left) > LATERAL_NOISE_MPS, limits.shape)] = 0.0
    unseen = Unseen(basis.policy.timing.stale_after_s)
    if basis.seen_s and basis.policy.applies(unseen.name):
        bearings = np.broadcast_to(travel_bearing_rad(forward, left, np), limits.shape)
        directions, which = np.unique(bearings, return_inverse=True)
        caps = [unseen.cap(basis.seen_s, each, basis.stamp_s) for each in directions.tolist()]
        np.minimum(limits, np.array(caps)[which], out=limits)
