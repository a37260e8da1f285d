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
from .policies import StandingPeople

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
    human_acceleration_mps2: ArrayLike = np.inf,
    start_delay_s: ArrayLike = 0.0,
) -> FloatArray:
    """Return the gap when the robot has stopped, for the worst robot that obeys the limit.

    The robot accelerates from its present speed up to the limit during the whole reaction time, and
    then brakes. The person walks straight at it until it stands. The gap only falls until then, so
    it is also the smallest gap while the robot moves.

    With a bound on human acceleration, the person stood at the given distance and has been speeding
    up since ``start_delay_s`` before the start. Nobody counts as farther than a walker who was
    there at the start.

    Args:
        separation_m: true distance between the surfaces at the start; like every argument a scalar
            or any broadcastable shape.
        speed_mps: of the robot at the start, in [0, limit].
        limit_mps: the speed limit at the start; with a limit of 0 the robot stands.
        human_speed_mps: ≥ 0.
        acceleration_mps2: > 0.
        deceleration_mps2: > 0.
        reaction_time_s: ≥ 0.
        human_acceleration_mps2: > 0; infinite for a person who walks at ``human_speed_mps``.
        start_delay_s: ≥ 0.

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
    walked_m = _walked_m(T + fastest / down, v_h, human_acceleration_mps2, start_delay_s)
    gap: FloatArray = np.where(fastest > 0.0, d - way_m - walked_m, d)
    return gap


def _walked_m(
    time_s: FloatArray, v_h: FloatArray, acceleration_mps2: ArrayLike, delay_s: ArrayLike
) -> FloatArray:
    """Return the way of a person, from the mean speed while speeding up and the speed after it."""
    a_h = np.asarray(acceleration_mps2, dtype=np.float64)
    since_s = time_s + np.asarray(delay_s, dtype=np.float64)
    reached_mps = np.minimum(v_h, np.where(np.isfinite(a_h), a_h * since_s, v_h))
    speeding_up_s = np.where(np.isfinite(a_h), reached_mps / a_h, 0.0)
    started_m = 0.5 * reached_mps * speeding_up_s + reached_mps * (since_s - speeding_up_s)
    return np.asarray(np.minimum(started_m, v_h * time_s))


def check_states(
    separation_m: ArrayLike,
    speed_share: ArrayLike,
    human_speed_mps: ArrayLike,
    *,
    acceleration_mps2: ArrayLike,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
    human_acceleration_mps2: ArrayLike = np.inf,
    start_delay_s: ArrayLike = 0.0,
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
        human_acceleration_mps2: of a person who stands at the start; infinite for one who walks.
        start_delay_s: how long this person has been walking unnoticed.
        maximum_mps: top speed of the robot, whatever the limit.
        limit: the formula under test, called like :func:`max_speed_mps`.
    """
    start = {}
    if np.isfinite(human_acceleration_mps2).any():
        start = {
            "human_acceleration_mps2": human_acceleration_mps2,
            "start_delay_s": start_delay_s,
        }
    limit_mps = np.minimum(
        limit(
            separation_m,
            human_speed_mps,
            deceleration_mps2=deceleration_mps2,
            reaction_time_s=reaction_time_s,
            clearance_m=clearance_m,
            **start,
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
        **start,
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
    robot: RobotProfile,
    *,
    human_speed_mps: float = 1.6,
    clearance_m: float = 0.1,
    standing: StandingPeople | None = None,
) -> SeparationProof:
    """Check the limit for one robot: separations of 0–20 m, all starting speeds, slower people too.

    Args:
        robot: the robot.
        human_speed_mps: the largest human speed.
        clearance_m: C + Z.
        standing: the rule for people who stand, and then the check is for these, at the delay
            ``start_delay_s``; None for people who walk.

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
        human_acceleration_mps2=np.inf if standing is None else standing.human_acceleration_mps2,
        start_delay_s=0.0 if standing is None else standing.start_delay_s,
        maximum_mps=robot.max_speed_mps,
    )
