"""Speed and separation: the protective separation for a speed, and the speed for a separation.

The protective separation distance of ISO/TS 15066 (from ISO 13855) for a robot that keeps its speed
v during the reaction time T and then brakes at a, while a person walks straight at it with speed
v_h until it stands:

    S_p = S_h + S_r + S_s + C + Z,   S_h = v_h (T + v/a),   S_r = v T,   S_s = v² / 2a

C (how far a body part reaches in before it is detected) and Z (the position uncertainty of the
robot) are given together as ``clearance_m``.

S_r + S_s is the robot's stopping distance. If only part of it can lead towards the person, who may
be beside or behind the robot, only the share ``approach`` counts: 1 straight ahead, 0 behind.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from perception.arrays import FloatArray

from ._errors import NavError


def protective_separation_m(
    speed_mps: ArrayLike,
    human_speed_mps: ArrayLike,
    *,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
    approach: ArrayLike = 1.0,
) -> FloatArray:
    """Return S_p, the separation that a robot must keep at this speed.

    Args:
        speed_mps: v ≥ 0 of the robot; like every argument a scalar or any broadcastable shape.
        human_speed_mps: v_h ≥ 0, the speed assumed for the person, straight at the robot.
        deceleration_mps2: a > 0.
        reaction_time_s: T ≥ 0.
        clearance_m: C + Z ≥ 0.
        approach: in [0, 1], the share of the stopping distance that can lead to the person.

    Returns:
        S_p in metres, in the broadcast shape.

    Raises:
        NavError: for a deceleration that is not positive.
    """
    v, v_h, a, T, C, share = _checked(
        speed_mps, human_speed_mps, deceleration_mps2, reaction_time_s, clearance_m, approach
    )
    separation: FloatArray = v_h * (T + v / a) + share * (v * T + v**2 / (2.0 * a)) + C
    return separation


def max_speed_mps(
    separation_m: ArrayLike,
    human_speed_mps: ArrayLike,
    *,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
    approach: ArrayLike = 1.0,
) -> FloatArray:
    """Return the highest speed whose protective separation is at most the given separation.

    The inverse of :func:`protective_separation_m` in v: the positive root of a quadratic equation,
    and 0 if even a standing robot is too close. A separation of NaN gives 0 too: an unknown
    distance gives a limit of 0.

    Args:
        separation_m: distance between the surfaces of robot and person; may be negative.
        human_speed_mps: v_h ≥ 0, the speed assumed for the person, straight at the robot.
        deceleration_mps2: a > 0.
        reaction_time_s: T ≥ 0.
        clearance_m: C + Z ≥ 0.
        approach: in [0, 1], the share of the stopping distance that can lead to the person.

    Returns:
        v_max ≥ 0 in m/s, in the broadcast shape; infinite if neither comes nearer (``approach`` and
        v_h are both 0).

    Raises:
        NavError: for a deceleration that is not positive.
    """
    return highest_speed_mps(
        *_checked(
            separation_m, human_speed_mps, deceleration_mps2, reaction_time_s, clearance_m, approach
        )
    )


def highest_speed_mps(
    separation_m: FloatArray,
    v_h: FloatArray,
    a: FloatArray | float,
    T: FloatArray,
    C: FloatArray | float,
    share: FloatArray,
) -> FloatArray:
    """Return :func:`max_speed_mps` of its arguments in their order, without checks."""
    spare = separation_m - C - v_h * T
    # Written so that NaN becomes 0.
    spare = np.where(spare > 0.0, spare, 0.0)
    b = share * a * T + v_h
    # The root of share·v²/2 + b·v = a·spare in the form that does not divide by a share of 0.
    denominator = b + np.sqrt(b**2 + 2.0 * a * share * spare)
    has_spare = spare > 0.0
    if has_spare.shape != denominator.shape:
        has_spare = np.broadcast_to(has_spare, np.broadcast(denominator, spare).shape)
    # A product too small for a float makes the denominator 0; the speed is then 0 too.
    speed: FloatArray = np.divide(
        2.0 * a * spare,
        denominator,
        out=np.where(has_spare & (share == 0.0), np.inf, 0.0),
        where=has_spare & (denominator > 0.0),
    )
    return speed


def _checked(
    distance_or_speed: ArrayLike,
    human_speed_mps: ArrayLike,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
    approach: ArrayLike,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the arguments as arrays, after checking that the deceleration is positive."""
    a = np.asarray(deceleration_mps2, dtype=np.float64)
    if not bool((a > 0.0).all()):
        raise NavError(f"deceleration_mps2 must be > 0 m/s², got {deceleration_mps2!r:.80}")
    first, v_h, T, C, share = (
        np.asarray(value, dtype=np.float64)
        for value in (distance_or_speed, human_speed_mps, reaction_time_s, clearance_m, approach)
    )
    return first, v_h, a, T, C, share
