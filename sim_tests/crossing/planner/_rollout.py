"""Closed-form motion of a differential drive: roll-outs of a planner's candidates, and braking.

Time runs along the first axis of every array.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from perception.arrays import FloatArray


class Poses(NamedTuple):
    """Planar poses in a frame; the four arrays broadcast against each other.

    Attributes:
        x_m: position.
        y_m: position.
        cos_heading: cosine of the heading, counter-clockwise from the frame's x axis.
        sin_heading: sine of the heading.
    """

    x_m: FloatArray
    y_m: FloatArray
    cos_heading: FloatArray
    sin_heading: FloatArray

    def transformed(self, frame: Poses) -> Poses:
        """Return these poses in the outer frame in which their own frame has the pose ``frame``."""
        c, s = frame.cos_heading, frame.sin_heading
        return Poses(
            np.asarray(frame.x_m + c * self.x_m - s * self.y_m),
            np.asarray(frame.y_m + s * self.x_m + c * self.y_m),
            np.asarray(c * self.cos_heading - s * self.sin_heading),
            np.asarray(s * self.cos_heading + c * self.sin_heading),
        )


def clip_to_window(value: ArrayLike, now: float, fall: float, rise: float) -> FloatArray:
    """Return ``value`` clipped to the reach of one tick: ``now − fall`` to ``now + rise``."""
    return np.asarray(np.minimum(np.maximum(value, now - fall), now + rise), dtype=np.float64)


def ramp_integral(
    initial: FloatArray | float, target: FloatArray, rate: FloatArray | float, t_s: FloatArray
) -> FloatArray:
    """Return the time integral of a value that ramps to ``target`` at ``rate`` and stays there.

    Args:
        initial: value at t = 0.
        target: final value, broadcast against ``t_s``.
        rate: change per second, > 0.
        t_s: upper limits of the integral, ≥ 0.
    """
    gap = target - initial
    ramp_s = np.minimum(t_s, np.abs(gap) / rate)
    return np.asarray(target * t_s - gap * ramp_s + 0.5 * np.copysign(rate, gap) * ramp_s**2)


def stopping_integral(
    value: FloatArray, stop_time_s: FloatArray, hold_s: float, t_s: FloatArray
) -> FloatArray:
    """Return the time integral of a value that is held for ``hold_s`` and then ramps to zero.

    ``stop_time_s`` (≥ 0) is the duration of the ramp; after it the value is zero.
    """
    fall_s = np.minimum(np.maximum(t_s - hold_s, 0.0), stop_time_s)
    # With stop_time_s = 0, fall_s is 0 as well, and any positive divisor is right.
    share = fall_s / np.maximum(stop_time_s, 1e-12)
    return np.asarray(value * (np.minimum(t_s, hold_s) + fall_s * (1.0 - 0.5 * share)))


def follow_arcs(path_m: FloatArray, turn_rad: FloatArray) -> Poses:
    """Return poses along chains of circular arcs that start at the origin, heading along x.

    Each step between two samples is an arc: exact where the curvature is constant over the step.

    Args:
        path_m: (T, ...) travelled distance at each sample.
        turn_rad: (T, ...) heading at each sample, broadcast against ``path_m``.
    """
    half_turn = 0.5 * _steps(turn_rad)
    # chord / arc = sin(h)/h by its series; the error h⁶/5040 is below 1e-6 for a step of 0.8 rad.
    h2 = half_turn * half_turn
    chord = 1.0 - h2 * (1.0 - h2 / 20.0) / 6.0
    middle = turn_rad - half_turn
    step_m = _steps(path_m)
    return Poses(
        np.add.accumulate(step_m * (chord * np.cos(middle)), axis=0),
        np.add.accumulate(step_m * (chord * np.sin(middle)), axis=0),
        np.cos(turn_rad),
        np.sin(turn_rad),
    )


def _steps(value: FloatArray) -> FloatArray:
    """Return the differences along the first axis, the first one from zero."""
    steps: FloatArray = value.copy()
    steps[1:] -= value[:-1]
    return steps
