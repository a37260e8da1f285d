"""Where the obstacles will be over the horizon of a model-predictive controller."""

from __future__ import annotations

from typing import Any

import numpy as np

from perception.arrays import FloatArray, finite_array, finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from ._shapes import circles

# Of an empty slot, beside the robot: out of reach, and small enough for a solver's scaling.
_FAR_M = 100.0


def predicted_circles(
    constraints: NavConstraints,
    times_s: Any,
    *,
    growth_mps: float = 0.0,
    slots: int | None = None,
    robot_position_odom_m: Any = None,
) -> FloatArray:
    """(N, T, 5) x, y (m), vx, vy (m/s), radius (m) of every person at every time.

    People go on at their velocity; their radius grows with time by ``growth_mps``, for what they
    might do instead.

    A controller that is built once has a fixed number of obstacles. With ``slots`` the first axis
    has that length: the people whose circle comes nearest to the robot within the times, nearest
    first, and then circles of radius 0, 100 m away. ``speed_limit_mps`` counts everybody, also
    those left out.

    Args:
        constraints: the people.
        times_s: (T,) seconds after ``constraints.stamp_s``, ≥ 0.
        growth_mps: ≥ 0.
        slots: ≥ 1, or None for one a person in the order of ``constraints.obstacles``.
        robot_position_odom_m: (2,), needed with ``slots``.

    Raises:
        NavError: an argument that is not finite or out of bounds.
    """
    times = finite_array("times_s", times_s, ("T",), NavError)
    if bool((times < 0.0).any()):
        raise NavError(f"times_s must not be negative, got {times.min():g} s")
    growth = finite_number("growth_mps", growth_mps, NavError, minimum=0.0)
    now = circles(constraints)
    out = np.repeat(now[:, None, :], len(times), axis=1)
    out[:, :, :2] += times[:, None] * now[:, None, 2:4]
    out[:, :, 4] += growth * times
    if slots is None:
        return out
    if isinstance(slots, bool) or not isinstance(slots, int) or slots < 1:
        raise NavError(f"slots must be a whole number of at least 1, got {slots!r}")
    if robot_position_odom_m is None:
        raise NavError("slots needs robot_position_odom_m, (2,) in metres, to tell who is nearest")
    robot = finite_array("robot_position_odom_m", robot_position_odom_m, (2,), NavError)
    filled = np.zeros((slots, len(times), 5))
    filled[:, :, :2] = robot + np.array([_FAR_M, 0.0])
    gap = np.hypot(out[:, :, 0] - robot[0], out[:, :, 1] - robot[1]) - out[:, :, 4]
    nearest = np.argsort(gap.min(axis=1, initial=np.inf), kind="stable")[:slots]
    filled[: len(nearest)] = out[nearest]
    return filled
