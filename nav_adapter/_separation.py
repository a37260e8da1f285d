"""Speed-and-separation mathematics: how far apart for a speed, how fast for a separation.

The protective separation distance of ISO/TS 15066 (which takes it from ISO 13855) for a robot that
keeps its speed v during the reaction time T and then brakes at a, while a person walks straight
at it with speed v_h until it stands:

    S_p = S_h + S_r + S_s + C + Z,   S_h = v_h (T + v/a),   S_r = v T,   S_s = v² / 2a

C (how far a body part reaches in before it is noticed) and Z (the position uncertainty of the
robot) act together and are given together as ``clearance_m``.

S_r + S_s is the robot's stopping distance. Where the robot cannot get that far towards the person,
because they stand behind it, only the share ``approach`` of it counts: 1 straight ahead, 0 behind.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from perception.arrays import FloatArray

from ._errors import NavError


def _positive_deceleration(deceleration_mps2: ArrayLike) -> FloatArray:
    deceleration = np.asarray(deceleration_mps2, dtype=np.float64)
    if not bool((deceleration > 0.0).all()):
        raise NavError(f"deceleration_mps2 must be > 0 m/s², got {deceleration_mps2!r:.80}")
    return deceleration


def protective_separation_m(
    speed_mps: ArrayLike,
    human_speed_mps: ArrayLike,
    *,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
    approach: ArrayLike = 1.0,
) -> FloatArray:
    """Separation that a robot at this speed must keep: S_p of the module's formula.

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
        NavError: a deceleration that is not positive.
    """
    a = _positive_deceleration(deceleration_mps2)
    v, v_h, T, C, share = (
        np.asarray(value, dtype=np.float64)
        for value in (speed_mps, human_speed_mps, reaction_time_s, clearance_m, approach)
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
    """Highest speed whose protective separation fits into the separation there is.

    The inverse of :func:`protective_separation_m` in v: the positive root of a quadratic, and 0
    where even a standing robot is too close. A NaN separation also gives 0: not knowing is no
    licence to drive.

    Args:
        separation_m: distance between the surfaces of robot and person; may be negative.
        human_speed_mps: v_h ≥ 0, the speed assumed for the person, straight at the robot.
        deceleration_mps2: a > 0.
        reaction_time_s: T ≥ 0.
        clearance_m: C + Z ≥ 0.
        approach: in [0, 1], the share of the stopping distance that can lead to the person.

    Returns:
        v_max ≥ 0 in m/s, in the broadcast shape; infinite where no speed is too much (neither comes
        nearer: ``approach`` and v_h are both 0).

    Raises:
        NavError: a deceleration that is not positive.
    """
    return highest_speed_mps(
        np.asarray(separation_m, dtype=np.float64),
        np.asarray(human_speed_mps, dtype=np.float64),
        _positive_deceleration(deceleration_mps2),
        np.asarray(reaction_time_s, dtype=np.float64),
        np.asarray(clearance_m, dtype=np.float64),
        np.asarray(approach, dtype=np.float64),
    )


def highest_speed_mps(
    separation_m: FloatArray,
    v_h: FloatArray,
    a: FloatArray | float,
    T: FloatArray,
    C: FloatArray | float,
    share: FloatArray,
) -> FloatArray:
    """:func:`max_speed_mps` of arguments that are sound, in their order."""
    spare = separation_m - C - v_h * T
    # Written this way round so that NaN lands on 0.
    spare = np.where(spare > 0.0, spare, 0.0)
    b = share * a * T + v_h
    # The root of share·v²/2 + b·v = a·spare in the form that does not divide by a share of 0.
    below = b + np.sqrt(b**2 + 2.0 * a * share * spare)
    some = spare > 0.0
    if some.shape != below.shape:
        some = np.broadcast_to(some, np.broadcast(below, spare).shape)
    # A root of a product too small for a float is 0 as well, and is no licence to drive.
    speed: FloatArray = np.divide(
        2.0 * a * spare,
        below,
        out=np.where(some & (share == 0.0), np.inf, 0.0),
        where=some & (below > 0.0),
    )
    return speed
