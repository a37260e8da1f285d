"""Speed and separation: the protective separation for a speed, and the speed for a separation.

The protective separation distance of ISO/TS 15066 (from ISO 13855) for a robot that keeps its speed
v during the reaction time T and then brakes at a, while a person walks straight at it with speed
v_h until it stands:

    S_p = S_h + S_r + S_s + C + Z,   S_h = v_h (T + v/a),   S_r = v T,   S_s = v² / 2a

C (how far a body part reaches in before it is detected) and Z (the position uncertainty of the
robot) are given together as ``clearance_m``. The adapter does not use it: it adds up what cannot
happen at once (``docs/safety.md``). It judges separations from outside, as the standards do.
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
) -> FloatArray:
    """Return S_p, the separation that a robot must keep at this speed.

    Args:
        speed_mps: v ≥ 0 of the robot; like every argument a scalar or any broadcastable shape.
        human_speed_mps: v_h ≥ 0, the speed assumed for the person, straight at the robot.
        deceleration_mps2: a > 0.
        reaction_time_s: T ≥ 0.
        clearance_m: C + Z ≥ 0.

    Returns:
        S_p in metres, in the broadcast shape.

    Raises:
        NavError: for a deceleration that is not positive.
    """
    v, v_h, a, T, C = _checked(
        speed_mps, human_speed_mps, deceleration_mps2, reaction_time_s, clearance_m
    )
    return np.asarray(v_h * (T + v / a) + v * T + v**2 / (2.0 * a) + C)


def max_speed_mps(
    separation_m: ArrayLike,
    human_speed_mps: ArrayLike,
    *,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
) -> FloatArray:
    """Return the highest speed whose protective separation is at most ``separation_m``.

    0 where even a standing robot is too close. A separation of NaN gives 0 too: an unknown distance
    gives a limit of 0.

    Args:
        separation_m: distance between the surfaces of robot and person; may be negative.
        human_speed_mps: v_h ≥ 0, the speed assumed for the person, straight at the robot.
        deceleration_mps2: a > 0.
        reaction_time_s: T ≥ 0.
        clearance_m: C + Z ≥ 0.

    Returns:
        v_max ≥ 0 in m/s, in the broadcast shape.

    Raises:
        NavError: for a deceleration that is not positive.
    """
    d, v_h, a, T, C = _checked(
        separation_m, human_speed_mps, deceleration_mps2, reaction_time_s, clearance_m
    )
    spare = d - C - v_h * T
    # Written so that NaN becomes 0.
    spare = np.where(spare > 0.0, spare, 0.0)
    b = a * T + v_h
    # The positive root of v²/2 + b v = a·spare, without cancellation.
    denominator = b + np.sqrt(b**2 + 2.0 * a * spare)
    speed: FloatArray = np.divide(
        2.0 * a * spare, denominator, out=np.zeros_like(denominator), where=denominator > 0.0
    )
    return speed


def _checked(
    distance_or_speed: ArrayLike,
    human_speed_mps: ArrayLike,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
) -> list[FloatArray]:
    """Return the arguments as arrays, after checking that the deceleration is positive."""
    given = (
        *(distance_or_speed, human_speed_mps, deceleration_mps2, reaction_time_s, clearance_m),
    )
    values = [np.asarray(value, dtype=np.float64) for value in given]
    if not (values[2] > 0.0).all():
        raise NavError(f"deceleration_mps2 must be > 0 m/s², got {deceleration_mps2!r:.80}")
    return values
