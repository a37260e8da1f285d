"""Closed-form motion of a robot, and the gaps from many of its poses to people and boxes.

Time runs along the first axis of every array.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from nav_adapter import RobotProfile
from perception.arrays import FloatArray

#: An axis-aligned box on the floor: x_min, y_min, x_max, y_max.
Box = tuple[float, float, float, float]


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


class Rectangles(NamedTuple):
    """Rectangles of the same width at many poses.

    Attributes:
        centers: poses of the centres, heading along the length.
        half_length_m: one number, or one per pose.
        half_width_m: one number.
    """

    centers: Poses
    half_length_m: FloatArray | float
    half_width_m: float


def disc_gap_m(
    rectangles: Rectangles, x_m: FloatArray, y_m: FloatArray, radius_m: FloatArray
) -> FloatArray:
    """Return the distance from rectangles to discs; negative where they overlap.

    Exact while the disc's centre is outside the rectangle; inside, minus the radius.

    Args:
        rectangles: the rectangles.
        x_m: disc centres in the frame of the rectangles, broadcast against their poses.
        y_m: disc centres, the same along y.
        radius_m: radii of the discs.
    """
    centers, half_length, half_width = rectangles
    c, s = centers.cos_heading, centers.sin_heading
    rel_x, rel_y = centers.x_m - x_m, centers.y_m - y_m
    along = np.maximum(np.abs(rel_x * c + rel_y * s) - half_length, 0.0)
    across = np.maximum(np.abs(rel_y * c - rel_x * s) - half_width, 0.0)
    return np.asarray(np.sqrt(along * along + across * across) - radius_m)


def box_gap_m(rectangles: Rectangles, boxes_m: Iterable[Box]) -> FloatArray:
    """Return a lower bound of the distance from rectangles to the nearest axis-aligned box.

    A rectangle counts with its axis-aligned bounding box, and a diagonal gap with its larger
    component: exact along a wall, below the true distance at a corner. Negative where the bounding
    box overlaps a box; infinite without boxes.

    Args:
        rectangles: in the frame of the boxes.
        boxes_m: the boxes.
    """
    centers, half_length, half_width = rectangles
    cos_abs, sin_abs = np.abs(centers.cos_heading), np.abs(centers.sin_heading)
    extent_x = half_length * cos_abs + half_width * sin_abs
    extent_y = half_length * sin_abs + half_width * cos_abs
    x_low, x_high = centers.x_m - extent_x, centers.x_m + extent_x
    y_low, y_high = centers.y_m - extent_y, centers.y_m + extent_y
    nearest = np.full(np.shape(x_low), np.inf)
    gap, other = np.empty_like(nearest), np.empty_like(nearest)
    for x_min, y_min, x_max, y_max in boxes_m:
        np.subtract(x_min, x_high, out=gap)
        np.maximum(gap, np.subtract(x_low, x_max, out=other), out=gap)
        np.maximum(gap, np.subtract(y_min, y_high, out=other), out=gap)
        np.maximum(gap, np.subtract(y_low, y_max, out=other), out=gap)
        np.minimum(nearest, gap, out=nearest)
    return nearest


@dataclass(frozen=True, slots=True, eq=False)
class FootprintBox:
    """The bounding rectangle of a robot's outline, along its axes.

    Attributes:
        center_m: (x, y) in the base frame.
        half_size_m: half the length and half the width.
        reach_m: distance from the base origin to the farthest corner.
        turning_margin_m: distance by which the circle of that radius exceeds the front edge.
    """

    center_m: tuple[float, float]
    half_size_m: tuple[float, float]
    reach_m: float
    turning_margin_m: float

    @classmethod
    def of(cls, robot: RobotProfile) -> FootprintBox:
        """Return the box of ``robot``."""
        x_min, y_min = robot.footprint_m.min(axis=0).tolist()
        x_max, y_max = robot.footprint_m.max(axis=0).tolist()
        reach = math.hypot(max(-x_min, x_max), max(-y_min, y_max))
        return cls(
            (0.5 * (x_min + x_max), 0.5 * (y_min + y_max)),
            (0.5 * (x_max - x_min), 0.5 * (y_max - y_min)),
            reach,
            reach - x_max,
        )

    def at(self, base_poses: Poses, front_margin_m: FloatArray | float = 0.0) -> Rectangles:
        """Return the footprint at base poses, with its front edge moved out by a margin."""
        x, y, c, s = base_poses
        along = self.center_m[0] + 0.5 * front_margin_m
        across = self.center_m[1]
        if np.ndim(along) or along != 0.0:
            x, y = np.asarray(x + along * c), np.asarray(y + along * s)
        if across != 0.0:
            x, y = np.asarray(x - across * s), np.asarray(y + across * c)
        half_length, half_width = self.half_size_m
        return Rectangles(Poses(x, y, c, s), half_length + 0.5 * front_margin_m, half_width)
