"""Brakings in odometry: how hard they are, and how far they lead off the robot's curve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from nav_adapter.ros2.conversions import pose_matrix, to_seconds
from nav_adapter.ros2.messages.geometry_msgs import Point
from nav_adapter.ros2.messages.nav_msgs import Odometry
from perception.arrays import FloatArray

# The robot brakes where it loses so much of its speed, from at least so much, that hard.
_FROM_MPS: Final = 0.4
_LOSES: Final = 0.5
_HARD_MPS2: Final = 0.25
# Odometry is looked at in equal steps, as smooth as this makes it.
_STEP_S: Final = 0.02
_SMOOTH_S: Final = 0.24
# Time before, whose curve counts.
_BEFORE_S: Final = 0.3


class Braking(NamedTuple):
    """One time at which the robot braked.

    Attributes:
        speed_mps: before.
        deceleration_mps2: on average.
        off_rad: ≥ 0, how far it turned off the curve that it was on, at most.
    """

    speed_mps: float
    deceleration_mps2: float
    off_rad: float


def brakings(odometry: Sequence[Odometry]) -> list[Braking]:
    """Return the times at which a robot braked."""
    stamps_s, first = np.unique(
        [to_seconds(each.header.stamp) for each in odometry], return_index=True
    )
    odometry = [odometry[index] for index in first]
    times_s = np.arange(stamps_s[0], stamps_s[-1], _STEP_S)
    if len(times_s) < 4.0 * _SMOOTH_S / _STEP_S:
        return []
    twists = [each.twist.twist for each in odometry]
    turns = [pose_matrix(Point(), each.pose.pose.orientation) for each in odometry]
    headings = np.unwrap([math.atan2(each[1, 0], each[0, 0]) for each in turns])
    speeds_mps, rates_radps, headings_rad = (
        _smooth(np.interp(times_s, stamps_s, values))
        for values in (
            _without_dropouts(
                np.array([math.hypot(each.linear.x, each.linear.y) for each in twists])
            ),
            np.array([each.angular.z for each in twists]),
            headings,
        )
    )
    slowing_mps2 = -np.gradient(speeds_mps, _STEP_S)
    edges = np.flatnonzero(np.diff(slowing_mps2 >= _HARD_MPS2, prepend=False, append=False))
    found = []
    for begin, end in zip(edges[::2], edges[1::2] - 1, strict=True):
        speed_mps, lost_mps = speeds_mps[begin], speeds_mps[begin] - speeds_mps[end]
        if speed_mps < _FROM_MPS or lost_mps < _LOSES * speed_mps:
            continue
        # It may have begun to turn while the smooth speed was still high.
        start = max(begin - round(_SMOOTH_S / _STEP_S), 0)
        before = slice(max(start - round(_BEFORE_S / _STEP_S), 0), start + 1)
        curvature_radpm = rates_radps[before].mean() / speeds_mps[before].mean()
        ways_m = np.cumsum(speeds_mps[start : end + 1]) * _STEP_S
        turned_rad = headings_rad[start : end + 1] - headings_rad[start]
        off_rad = float(np.max(np.abs(turned_rad - curvature_radpm * ways_m)))
        # Both ends of a ramp are smooth.
        quarter = (end - begin) // 4
        hard_mps2 = float(slowing_mps2[begin + quarter : end - quarter + 1].mean())
        found.append(Braking(float(speed_mps), hard_mps2, off_rad))
    return found


def _without_dropouts(values: FloatArray) -> FloatArray:
    """Return each value or, where that is another, the median of it and its neighbours."""
    around = np.stack((np.roll(values, 1), values, np.roll(values, -1)))
    return np.concatenate((values[:1], np.median(around, axis=0)[1:-1], values[-1:]))


def _smooth(values: FloatArray) -> FloatArray:
    """Return running means, as at the ends beyond them."""
    width = round(_SMOOTH_S / _STEP_S) // 2
    padded = np.pad(values, width, mode="edge")
    return np.convolve(padded, np.full(2 * width + 1, 1.0 / (2 * width + 1)), mode="valid")
