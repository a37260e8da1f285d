"""The limits of all people and rules at many poses at once."""

from __future__ import annotations

import math

import numpy as np

from perception.arrays import FloatArray

from .._constraints import NavConstraints
from .._errors import NavError
from .._known import SpeedBasis
from .._robot import LATERAL_NOISE_MPS, RobotProfile
from ..course import travel_bearing_rad
from ..rules import Unseen
from ._courses import Value, courses_at
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
    turned = None
    if basis.policy.applies("reach"):
        turned = own.turned(np.float32(math.radians(basis.policy.reach.turn_deg)), np)
    field = (
        own.grown(basis.policy.margins.clearance_m) if basis.policy.applies("in the path") else None
    )
    given = np.tile(np.arange(shape[1]), shape[0]), basis, robot, reach_m
    Field(Reaches.of(known, basis, robot), turned, field, *given).lower(limits)
    walkers = [ahead for ahead in known if any(each.reach.walks_faster for each in ahead)]
    if walkers and basis.policy.applies("walking on"):
        on = [
            [each._replace(reach=each.reach.walking_on(), first_sight_mps=0.0) for each in ahead]
            for ahead in walkers
        ]
        Field(Reaches.of(on, basis, robot), own, None, *given).lower(limits)
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
