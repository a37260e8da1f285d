"""Speed and separation: the protective separation for a speed, and the speed for a separation.

The protective separation distance of ISO/TS 15066 (from ISO 13855) for a robot that keeps its speed
v during the reaction time T and then brakes at a, while a person walks straight at it with speed
v_h until it stands:

    S_p = S_h + S_r + S_s + C + Z,   S_h = v_h (T + v/a),   S_r = v T,   S_s = v² / 2a

C (how far a body part reaches in before it is detected) and Z (the position uncertainty of the
robot) are given together as ``clearance_m``.

S_r + S_s is the robot's stopping distance. If only part of it can lead towards the person, who may
be beside or behind the robot, only the share ``approach`` counts: 1 straight ahead, 0 behind.

Somebody who stands does not walk at v_h at once. With a bound a_h on human acceleration, such a
person is assumed to have begun by the delay δ before anybody could notice it, and S_h is the way
since then, or that of a walker if it is shorter:

    S_h = min(v_h t, D(t + δ)),   t = T + v/a
    D(s) = a_h s² / 2 while a_h s ≤ v_h, and v_h s − v_h² / 2a_h from then on
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from perception.arrays import FloatArray

from ._errors import NavError

_Value: TypeAlias = Any  # a float or a FloatArray


def protective_separation_m(
    speed_mps: ArrayLike,
    human_speed_mps: ArrayLike,
    *,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
    approach: ArrayLike = 1.0,
    human_acceleration_mps2: ArrayLike = np.inf,
    start_delay_s: ArrayLike = 0.0,
) -> FloatArray:
    """Return S_p, the separation that a robot must keep at this speed.

    Args:
        speed_mps: v ≥ 0 of the robot; like every argument a scalar or any broadcastable shape.
        human_speed_mps: v_h ≥ 0, the speed assumed for the person, straight at the robot.
        deceleration_mps2: a > 0.
        reaction_time_s: T ≥ 0.
        clearance_m: C + Z ≥ 0.
        approach: in [0, 1], the share of the stopping distance that can lead to the person.
        human_acceleration_mps2: a_h > 0 of a standing person; infinite, the default, for a person
            who may be walking at v_h already.
        start_delay_s: δ ≥ 0, how long a standing person may have been walking unnoticed.

    Returns:
        S_p in metres, in the broadcast shape.

    Raises:
        NavError: for an acceleration or deceleration that is not positive, or a negative delay.
    """
    v, v_h, a, T, C, share = _checked(
        speed_mps, human_speed_mps, deceleration_mps2, reaction_time_s, clearance_m, approach
    )
    start = _checked_start(human_acceleration_mps2, start_delay_s)
    if start is not None:
        return separation_from_standing_m(v, v_h, a, T, C, share, *start)
    stopping_m = share * (v * T + v * v / (2.0 * a))
    separation: FloatArray = np.float64(v_h * (T + v / a) + stopping_m + C)
    return separation


def max_speed_mps(
    separation_m: ArrayLike,
    human_speed_mps: ArrayLike,
    *,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
    approach: ArrayLike = 1.0,
    human_acceleration_mps2: ArrayLike = np.inf,
    start_delay_s: ArrayLike = 0.0,
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
        human_acceleration_mps2: a_h > 0 of a standing person; infinite, the default, for a person
            who may be walking at v_h already.
        start_delay_s: δ ≥ 0, how long a standing person may have been walking unnoticed.

    Returns:
        v_max ≥ 0 in m/s, in the broadcast shape; infinite if neither comes nearer (``approach`` and
        v_h are both 0).

    Raises:
        NavError: for an acceleration or deceleration that is not positive, or a negative delay.
    """
    distance, v_h, a, T, C, share = map(
        np.asarray,
        _checked(
            separation_m, human_speed_mps, deceleration_mps2, reaction_time_s, clearance_m, approach
        ),
    )
    start = _checked_start(human_acceleration_mps2, start_delay_s)
    if start is None:
        return highest_speed_mps(distance, v_h, a, T, C, share)
    return highest_speed_from_standing_mps(distance, v_h, a, T, C, share, *start)


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
    with np.errstate(over="ignore"):  # a share of 0 and a speed of nearly 0: infinite too
        speed: FloatArray = np.divide(
            2.0 * a * spare,
            denominator,
            out=np.where(has_spare & (share == 0.0), np.inf, 0.0),
            where=has_spare & (denominator > 0.0),
        )
    return speed


def highest_speed_from_standing_mps(
    separation_m: FloatArray,
    v_h: FloatArray,
    a: FloatArray | float,
    T: FloatArray,
    C: FloatArray | float,
    share: FloatArray,
    a_h: FloatArray | float,
    delay_s: FloatArray,
) -> FloatArray:
    """Return :func:`max_speed_mps` of its arguments in their order, without checks.

    Where a_h or the delay is infinite, it is :func:`highest_speed_mps` to the bit. A delay below 0,
    but at least −T, is the time for which the person still stands.
    """
    bounded = np.isfinite(a_h) & np.isfinite(delay_s)
    a_h, delay_s = np.where(bounded, a_h, 1.0), np.where(bounded, delay_s, 0.0)
    speeding_up_s = v_h / a_h
    # Still speeding up when the robot stands: the root of
    # (a_h/a + share) v²/2a + (a_h s/a + share T) v = spare.
    since_s = T + delay_s
    spare = separation_m - C - 0.5 * a_h * since_s**2
    # Written so that NaN becomes 0.
    spare = np.where(spare > 0.0, spare, 0.0)
    b = a_h * since_s / a + share * T
    denominator = b + np.sqrt(b**2 + 2.0 * (a_h / a + share) / a * spare)
    early_mps = np.divide(
        2.0 * spare, denominator, out=np.zeros_like(denominator), where=denominator > 0.0
    )
    is_early = bounded & (since_s + early_mps / a <= speeding_up_s)
    # At v_h then: like a walker who began half the time of speeding up later, if that is shorter.
    later_m = np.minimum(v_h * (delay_s - 0.5 * speeding_up_s), 0.0)
    later_m = np.where(bounded & ~is_early, later_m, 0.0)
    walker_mps = highest_speed_mps(separation_m, v_h, a, T, C + later_m, share)
    # The shorter way is the higher speed.
    return np.asarray(np.where(is_early, np.maximum(walker_mps, early_mps), walker_mps))


def separation_from_standing_m(
    v: FloatArray | float,
    v_h: FloatArray,
    a: FloatArray | float,
    T: FloatArray,
    C: FloatArray | float,
    share: FloatArray,
    a_h: FloatArray | float,
    delay_s: FloatArray,
) -> FloatArray:
    """Return :func:`protective_separation_m` of its arguments in their order, without checks.

    A delay below 0 is the time for which the person still stands.
    """
    stopping_m = share * (v * T + v * v / (2.0 * a))
    return np.asarray(_walked_m(T + v / a, v_h, a_h, delay_s) + stopping_m + C)


def _walked_m(
    time_s: FloatArray, v_h: FloatArray, a_h: FloatArray | float, delay_s: FloatArray
) -> FloatArray:
    """Return S_h over ``time_s``: v_h t, or the way from standing if that is shorter."""
    bounded = np.isfinite(a_h) & np.isfinite(delay_s)
    a_h, since_s = np.where(bounded, a_h, 1.0), time_s + np.where(bounded, delay_s, 0.0)
    since_s = np.maximum(since_s, 0.0)
    speeding_up_s = np.minimum(since_s, v_h / a_h)
    started_m = 0.5 * a_h * speeding_up_s**2 + v_h * (since_s - speeding_up_s)
    return np.asarray(
        np.where(bounded, np.minimum(v_h * time_s, started_m), v_h * time_s), dtype=np.float64
    )


def _checked_start(
    human_acceleration_mps2: ArrayLike, start_delay_s: ArrayLike
) -> tuple[FloatArray, FloatArray] | None:
    """Return a_h and δ as arrays after a check, or None if no acceleration is bounded."""
    a_h, delay_s = _value(human_acceleration_mps2), _value(start_delay_s)
    if not _holds(a_h > 0.0):
        raise NavError(
            f"human_acceleration_mps2 must be > 0 m/s², got {human_acceleration_mps2!r:.80}"
        )
    if not _holds(delay_s >= 0.0):
        raise NavError(f"start_delay_s must be >= 0 s, got {start_delay_s!r:.80}")
    if not (math.isfinite(a_h) if isinstance(a_h, float) else np.isfinite(a_h).any()):
        return None
    return np.asarray(a_h), np.asarray(delay_s)


def _checked(
    distance_or_speed: ArrayLike,
    human_speed_mps: ArrayLike,
    deceleration_mps2: ArrayLike,
    reaction_time_s: ArrayLike,
    clearance_m: ArrayLike,
    approach: ArrayLike,
) -> tuple[_Value, _Value, _Value, _Value, _Value, _Value]:
    """Return the arguments after checking that the deceleration is positive."""
    a = _value(deceleration_mps2)
    if not _holds(a > 0.0):
        raise NavError(f"deceleration_mps2 must be > 0 m/s², got {deceleration_mps2!r:.80}")
    first, v_h, T, C, share = map(
        _value, (distance_or_speed, human_speed_mps, reaction_time_s, clearance_m, approach)
    )
    return first, v_h, a, T, C, share


def _holds(flags: Any) -> bool:
    return flags if isinstance(flags, bool) else bool(flags.all())


def _value(value: ArrayLike) -> _Value:
    """Return an array, or a Python float as it is: arithmetic on that is ten times as fast."""
    return value if type(value) is float else np.asarray(value, dtype=np.float64)
