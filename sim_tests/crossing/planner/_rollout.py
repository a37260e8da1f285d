"""Where to head when someone stands between the robot and its goal.

Closed-form motion of a differential drive: candidates of a planner, rolled out and braked.

Time runs along the first axis of every array.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from perception.arrays import FloatArray

# Passing on the left has to be this much less of a turn: else the robot keeps right.
_KEEP_RIGHT_RAD = 0.1


def detour_bearing_rad(
    goal_bearing_rad: float,
    goal_distance_m: float,
    discs_m: Sequence[tuple[float, float, float]],
    is_free: Callable[[float, float], bool],
) -> float:
    """Bearing of the goal, or of the tangent past the nearest disc that hides the goal.

    Sampled motions of a few seconds do not find the way round something right in front; the tangent
    of a visibility graph does. Where both sides are closed the goal's bearing stays and the robot
    waits.

    Args:
        goal_bearing_rad: in the base frame.
        goal_distance_m: discs beyond it do not hide it.
        discs_m: (x, y, radius) in the base frame; the radius holds the robot's own half width.
        is_free: whether boxes leave room for the robot at (x, y) m, on its way to the goal.
    """
    for x, y, radius in sorted(discs_m, key=lambda disc: math.hypot(disc[0], disc[1]) - disc[2]):
        distance = math.hypot(x, y)
        if distance >= goal_distance_m or distance < 1e-9:
            continue
        # From inside a disc the way out is square to its centre.
        half_angle = math.asin(min(1.0, radius / distance))
        to_left = math.remainder(math.atan2(y, x) - goal_bearing_rad, math.tau) + half_angle
        to_right = 2.0 * half_angle - to_left
        if to_left <= 0.0 or to_right <= 0.0:
            continue
        # The narrowest place is beside the person: square to the way to the goal.
        beside = radius * math.cos(goal_bearing_rad), radius * math.sin(goal_bearing_rad)
        left = goal_bearing_rad + to_left, (x - beside[1], y + beside[0])
        right = goal_bearing_rad - to_right, (x + beside[1], y - beside[0])
        sides = (left, right) if to_left < to_right - _KEEP_RIGHT_RAD else (right, left)
        return next((bearing for bearing, gate in sides if is_free(*gate)), goal_bearing_rad)
    return goal_bearing_rad


class Poses(NamedTuple):
    """Planar poses in some frame; the four arrays broadcast against each other.

    Attributes:
        x_m: position.
        y_m: position.
        cos_heading: of the counter-clockwise angle from the frame's x axis.
        sin_heading: of the same.
    """

    x_m: FloatArray
    y_m: FloatArray
    cos_heading: FloatArray
    sin_heading: FloatArray

    def seen_from(self, outer: Poses) -> Poses:
        """These poses in the frame in which ``outer`` is the pose of their own frame."""
        c, s = outer.cos_heading, outer.sin_heading
        return Poses(
            np.asarray(outer.x_m + c * self.x_m - s * self.y_m),
            np.asarray(outer.y_m + s * self.x_m + c * self.y_m),
            np.asarray(c * self.cos_heading - s * self.sin_heading),
            np.asarray(s * self.cos_heading + c * self.sin_heading),
        )


def window(value: ArrayLike, now: float, fall: float, rise: float) -> FloatArray:
    """``value`` as near as one tick gets to it from ``now``: within ``now − fall, now + rise``."""
    return np.asarray(np.minimum(np.maximum(value, now - fall), now + rise), dtype=np.float64)


def ramp_integral(
    initial: float, target: FloatArray, rate: FloatArray | float, t_s: FloatArray
) -> FloatArray:
    """Integral over time of a value that moves to ``target`` at ``rate`` and then stays there.

    Args:
        initial: the value at t = 0.
        target: where it goes, broadcast against ``t_s``.
        rate: how fast it moves, > 0, per second.
        t_s: the upper limits of the integral, ≥ 0.
    """
    gap = target - initial
    ramp_s = np.minimum(t_s, np.abs(gap) / rate)
    return np.asarray(target * t_s - gap * ramp_s + 0.5 * np.copysign(rate, gap) * ramp_s**2)


def stopping_integral(
    value: FloatArray, stop_time_s: FloatArray, hold_s: float, t_s: FloatArray
) -> FloatArray:
    """Integral over time of a value that is held for ``hold_s`` and then falls linearly to zero.

    ``stop_time_s`` (≥ 0) is the time of the fall alone; after it the value is zero.
    """
    fall_s = np.minimum(np.maximum(t_s - hold_s, 0.0), stop_time_s)
    # Where there is nothing to stop, fall_s is 0 as well, and any positive divisor does.
    share = fall_s / np.maximum(stop_time_s, 1e-12)
    return np.asarray(value * (np.minimum(t_s, hold_s) + fall_s * (1.0 - 0.5 * share)))


def follow_arcs(path_m: FloatArray, turn_rad: FloatArray) -> Poses:
    """Poses along chains of circular arcs that start at the origin, heading along x.

    Each step between two samples is an arc: exact where the curvature is constant over the step.

    Args:
        path_m: (T, ...) distance travelled at each sample.
        turn_rad: (T, ...) heading at each sample, broadcast against ``path_m``.
    """
    half_turn = 0.5 * _steps(turn_rad)
    # chord / arc = sin(h)/h by its series: off by h⁶/5040, below 1e-6 for a step of 0.8 rad.
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
    """Differences along the first axis, the first one from zero."""
    steps: FloatArray = value.copy()
    steps[1:] -= value[:-1]
    return steps
