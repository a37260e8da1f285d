"""A check of speed and separation by exact integration of the motion, without its formula.

To check the safety argument for a robot of your own::

    proof = check_robot(robot, human_speed_mps=1.6, clearance_m=0.1)
    assert proof.contacts == 0

``docs/safety.md`` says what this proves and what it does not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from perception.arrays import FloatArray, finite_number

from ._errors import NavError
from ._robot import RobotProfile
from ._separation import max_speed_mps

# Rounding of a dozen operations on metres.
_ROUNDING_M = 1e-9

Limit = Callable[..., FloatArray]


@dataclass(frozen=True, slots=True)
class SeparationProof:
    """Result of a check.

    Attributes:
        states: number of states checked.
        moving: number of them in which the limit lets the robot move.
        contacts: number in which the person reaches the moving robot; 0 proves the limit.
        smallest_gap_m: smallest gap at standstill of a robot that moved; negative after a contact.
    """

    states: int
    moving: int
    contacts: int
    smallest_gap_m: float


def gap_at_standstill_m(
    separation_m: ArrayLike,
    speed_mps: ArrayLike,
    limit_mps: ArrayLike,
    human_speed_mps: ArrayLike,
    *,
    acceleration_mps2: ArrayLike,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
) -> FloatArray:
    """Return the gap when the robot has stopped, for the worst robot that obeys the limit.

    The robot accelerates from its present speed up to the limit during the whole reaction time, and
    then brakes. The person walks straight at it until it stands. The gap only falls until then, so
    it is also the smallest gap while the robot moves.

    Args:
        separation_m: true distance between the surfaces at the start; like every argument a scalar
            or any broadcastable shape.
        speed_mps: of the robot at the start, in [0, limit].
        limit_mps: the speed limit at the start; with a limit of 0 the robot stands.
        human_speed_mps: ≥ 0.
        acceleration_mps2: > 0.
        deceleration_mps2: > 0.
        reaction_time_s: ≥ 0.

    Returns:
        Metres in the broadcast shape; negative if the person has reached the robot, and the
        separation itself if the robot never moves.
    """
    d, v, top, v_h, up, down, T = (
        np.asarray(value, dtype=np.float64)
        for value in (
            separation_m,
            speed_mps,
            limit_mps,
            human_speed_mps,
            acceleration_mps2,
            deceleration_mps2,
            reaction_time_s,
        )
    )
    faster_s = np.minimum(T, np.maximum(top - v, 0.0) / up)
    fastest = v + up * faster_s
    way_m = (v + 0.5 * up * faster_s) * faster_s + fastest * (T - faster_s)
    way_m = way_m + 0.5 * fastest**2 / down
    gap: FloatArray = np.where(fastest > 0.0, d - way_m - v_h * (T + fastest / down), d)
    return gap


def check_states(
    separation_m: ArrayLike,
    speed_share: ArrayLike,
    human_speed_mps: ArrayLike,
    *,
    acceleration_mps2: ArrayLike,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
    maximum_mps: float = np.inf,
    limit: Limit = max_speed_mps,
) -> SeparationProof:
    """Check every state of a grid. The arguments broadcast against each other.

    Args:
        separation_m: as measured. The true separation is assumed to be smaller by the whole
            ``clearance_m`` (C + Z).
        speed_share: speed of the robot at the start as a share of the limit, in [0, 1].
        human_speed_mps: speed that the limit assumes and at which the person walks.
        acceleration_mps2: of the robot up to the limit.
        deceleration_mps2: of the robot.
        reaction_time_s: time until the robot brakes.
        clearance_m: C + Z.
        maximum_mps: top speed of the robot, whatever the limit.
        limit: the formula under test, called like :func:`max_speed_mps`.
    """
    limit_mps = np.minimum(
        limit(
            separation_m,
            human_speed_mps,
            deceleration_mps2=deceleration_mps2,
            reaction_time_s=reaction_time_s,
            clearance_m=clearance_m,
        ),
        maximum_mps,
    )
    gap_m = gap_at_standstill_m(
        np.asarray(separation_m) - clearance_m,
        speed_share * limit_mps,
        limit_mps,
        human_speed_mps,
        acceleration_mps2=acceleration_mps2,
        deceleration_mps2=deceleration_mps2,
        reaction_time_s=reaction_time_s,
    )
    moving = np.broadcast_to(limit_mps > 0.0, gap_m.shape)
    moving_gap_m = gap_m[moving]
    return SeparationProof(
        states=int(gap_m.size),
        moving=int(moving.sum()),
        contacts=int((moving_gap_m < -_ROUNDING_M).sum()),
        smallest_gap_m=float(moving_gap_m.min(initial=np.inf)),
    )


def check_robot(
    robot: RobotProfile, *, human_speed_mps: float = 1.6, clearance_m: float = 0.1
) -> SeparationProof:
    """Check the limit for one robot: separations of 0–20 m, all starting speeds, slower people too.

    Raises:
        NavError: for a human speed or a clearance that is negative or not finite.
    """
    human = finite_number("human_speed_mps", human_speed_mps, NavError, minimum=0.0)
    clearance = finite_number("clearance_m", clearance_m, NavError, minimum=0.0)
    separation, share, speed = np.meshgrid(
        np.linspace(0.0, 20.0, 2001),
        np.linspace(0.0, 1.0, 11),
        np.linspace(0.0, human, 17),
        indexing="ij",
        sparse=True,
    )
    return check_states(
        separation,
        share,
        speed,
        acceleration_mps2=robot.max_acceleration_mps2,
        deceleration_mps2=robot.max_deceleration_mps2,
        reaction_time_s=robot.reaction_time_s,
        clearance_m=clearance,
        maximum_mps=robot.max_speed_mps,
    )
