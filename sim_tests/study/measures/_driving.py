"""Metrics of the robot's driving: path length, stops, deceleration and jerk."""

from __future__ import annotations

from typing import Final

import numpy as np

from perception.arrays import FloatArray

#: Width of the parabola that smooths the speed; docs/simulation.md gives its frequency response.
SMOOTHED_OVER_S: Final = 0.5
_DEGREE: Final = 2
#: A robot counts as moving above this speed; it stops when it falls below the standing speed.
MOVING_SPEED_MPS: Final = 0.10


def path_length_m(positions_m: FloatArray) -> float:
    """Return the length of the polyline through (N, 2) positions."""
    steps = np.diff(positions_m, axis=0)
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


def success_weighted(
    success: bool | None, actual: float | None, best: float | None
) -> float | None:
    """Return S · l / max(p, l): SPL of lengths (Anderson et al. 2018, equation 1), STL of times.

    Args:
        success: S.
        actual: p ≥ 0, the length or time of the episode; not used without success.
        best: l, that of the same task without people.

    Returns:
        None where success or ``best`` is not known.
    """
    if success is None or best is None or best <= 0.0 or (success and actual is None):
        return None
    return best / max(actual or 0.0, best) if success else 0.0


def count_stops(
    speeds_mps: FloatArray, arrived: bool, standing_mps: float, moving_mps: float = MOVING_SPEED_MPS
) -> int:
    """Return how often the robot came to a stand.

    Args:
        speeds_mps: (N,) speeds, signed or not.
        arrived: the goal was reached at the end; standing at the goal is not a stop.
        standing_mps: the robot stands below this speed.
        moving_mps: after a stop, the robot must exceed this speed before it can stop again.
    """
    stops, moving = 0, False
    for speed in np.abs(speeds_mps).tolist():
        if speed > moving_mps:
            moving = True
        elif speed < standing_mps and moving:
            stops, moving = stops + 1, False
    return stops - 1 if stops and arrived and not moving else stops


def peak_deceleration_and_jerk(
    t_s: FloatArray, velocities_mps: FloatArray
) -> tuple[float | None, float | None]:
    """Return the highest deceleration (m/s²) and the largest jerk (m/s³) of the actual velocity.

    They are the first and second derivatives of a parabola fitted to the velocities within ±0.25 s
    of each instant (Savitzky and Golay 1964). The first and last 0.25 s have no full window and are
    left out. Deceleration is the decrease of the speed; 0 if it never decreased. In the base frame
    the turning of a robot counts for neither.

    Args:
        t_s: (N,) evenly spaced.
        velocities_mps: (N,) signed speeds, or (N, 2) velocities in the base frame.

    Returns:
        None and None for an episode shorter than the window.
    """
    if len(t_s) < 2:
        return None, None
    dt_s = float(t_s[-1] - t_s[0]) / (len(t_s) - 1)
    window = _window_samples(dt_s)
    if len(t_s) < window:
        return None, None
    # Takes longer to import than the rest of the package; processes that only read runs do without.
    from scipy.signal import savgol_filter  # noqa: PLC0415

    whole = slice(window // 2, len(t_s) - window // 2)
    velocity = velocities_mps.reshape(len(t_s), -1)
    slope, curvature = (
        savgol_filter(velocity, window, _DEGREE, deriv=order, delta=dt_s, axis=0)[whole]
        for order in (1, 2)
    )
    speed = np.linalg.norm(velocity[whole], axis=1)
    moving = speed > 0.0
    deceleration = -np.sum(slope * velocity[whole], axis=1)[moving] / speed[moving]
    return (
        float(deceleration.max(initial=0.0)),
        float(np.linalg.norm(curvature, axis=1).max()),
    )


def _window_samples(dt_s: float) -> int:
    """Return the odd number of speeds in the window of a fit."""
    return max(2 * round(0.5 * SMOOTHED_OVER_S / dt_s) + 1, _DEGREE + 3)
