"""How the robot drove: way, stops, braking and jerk."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.signal import savgol_filter

from perception.arrays import FloatArray

#: Speed is smoothed by a parabola over so long; see docs/metrics.md for what that lets through.
SMOOTHED_OVER_S: Final = 0.5
_DEGREE: Final = 2
#: A robot faster than this has set out; one slower than the standing speed has stopped.
MOVING_SPEED_MPS: Final = 0.10


def path_length_m(positions_m: FloatArray) -> float:
    """Length of the polygon through (N, 2) positions."""
    steps = np.diff(positions_m, axis=0)
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


def success_weighted_path_length(
    success: bool, path_m: float, shortest_m: float | None
) -> float | None:
    """SPL of one episode: S · l / max(p, l) (Anderson et al. 2018, equation 1).

    Args:
        success: S.
        path_m: p ≥ 0, driven.
        shortest_m: l, of the same task without people; None if unknown, and so is SPL then.
    """
    if shortest_m is None or shortest_m <= 0.0:
        return None
    return shortest_m / max(path_m, shortest_m) if success else 0.0


def count_stops(
    speeds_mps: FloatArray, arrived: bool, standing_mps: float, moving_mps: float = MOVING_SPEED_MPS
) -> int:
    """How often the robot came to a stand.

    Args:
        speeds_mps: (N,) signed.
        arrived: the goal was reached at the end: a stand there is no stop.
        standing_mps: slower than this is a stand.
        moving_mps: only a robot that was faster since the last stop can stop again.
    """
    stops, moving = 0, False
    for speed in np.abs(speeds_mps).tolist():
        if speed > moving_mps:
            moving = True
        elif speed < standing_mps and moving:
            stops, moving = stops + 1, False
    return stops - 1 if stops and arrived and not moving else stops


def peak_deceleration_and_jerk(
    t_s: FloatArray, speeds_mps: FloatArray
) -> tuple[float | None, float | None]:
    """Highest deceleration (m/s²) and magnitude of jerk (m/s³) of the actual speed.

    The first and second derivatives of a parabola fitted to the speeds within ±0.25 s of each
    instant (Savitzky and Golay 1964), but for the first and last 0.25 s, where the fit would hang
    over. Deceleration is the fall of the speed's magnitude, 0 if it never fell.

    Args:
        t_s: (N,) evenly spaced.
        speeds_mps: (N,) signed.

    Returns:
        None twice for an episode shorter than the window.
    """
    if len(t_s) < 2:
        return None, None
    window, dt_s = _window(float(t_s[-1] - t_s[0]) / (len(t_s) - 1))
    if len(t_s) < window:
        return None, None
    whole = slice(window // 2, len(t_s) - window // 2)
    slope, bend = (
        savgol_filter(speeds_mps, window, _DEGREE, deriv=order, delta=dt_s)[whole]
        for order in (1, 2)
    )
    deceleration = -slope * np.sign(speeds_mps[whole])
    return max(float(deceleration.max()), 0.0), float(np.abs(bend).max())


def _window(dt_s: float) -> tuple[int, float]:
    """How many speeds a fit takes, an odd number, and the time between them."""
    return max(2 * round(0.5 * SMOOTHED_OVER_S / dt_s) + 1, _DEGREE + 3), dt_s
