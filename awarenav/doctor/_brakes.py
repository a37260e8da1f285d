"""How a robot brakes, from its odometry: how hard, and how far off the curve that it was on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
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
# A speed that rises by less than this is noise of the odometry.
_NOISE_MPS: Final = 0.03
# Share of what it loses, at either end, of which nothing is made.
_EDGE: Final = 0.1
# Time before, whose curve counts.
_BEFORE_S: Final = 0.3


class Braking(NamedTuple):
    """One time at which the robot braked.

    Attributes:
        speed_mps: before.
        deceleration_mps2: on average.
        off_rad: ≥ 0, how much farther it turned than on the curve that it was on.
    """

    speed_mps: float
    deceleration_mps2: float
    off_rad: float


def brakings(odometry: Sequence[Odometry]) -> list[Braking]:
    """Return the times at which a robot braked, from messages in the order of their stamps."""
    stamps_s = np.array([to_seconds(each.header.stamp) for each in odometry])
    twists = [each.twist.twist for each in odometry]
    speeds_mps = np.array([math.hypot(each.linear.x, each.linear.y) for each in twists])
    rates_radps = np.array([each.angular.z for each in twists])
    turns = [pose_matrix(Point(), each.pose.pose.orientation) for each in odometry]
    headings_rad = np.unwrap([math.atan2(each[1, 0], each[0, 0]) for each in turns])
    found = []
    for start, end in _falls(speeds_mps):
        speed_mps, fall_mps = speeds_mps[start], speeds_mps[start : end + 1]
        lost_mps = float(speed_mps - fall_mps[-1])
        # By the middle part: it may drive on before, and has noise as it stands.
        first = start + int(np.flatnonzero(fall_mps >= speed_mps - _EDGE * lost_mps)[-1])
        last = start + int(np.argmax(fall_mps <= fall_mps[-1] + _EDGE * lost_mps))
        took_s = float(stamps_s[last] - stamps_s[first]) / (1.0 - 2.0 * _EDGE)
        if speed_mps < _FROM_MPS or lost_mps < max(_LOSES * speed_mps, _HARD_MPS2 * took_s):
            continue
        began_s = stamps_s[first] - _EDGE * took_s
        before = (stamps_s >= began_s - _BEFORE_S) & (stamps_s <= began_s)
        if not before.any():
            continue
        curvature_radpm = rates_radps[before].mean() / speeds_mps[before].mean()
        way_m = (speed_mps - 0.5 * lost_mps) * took_s
        began_rad, stood_rad = np.interp([began_s, began_s + took_s], stamps_s, headings_rad)
        off_rad = abs(float(stood_rad - began_rad - curvature_radpm * way_m))
        found.append(Braking(float(speed_mps), lost_mps / took_s, off_rad))
    return found


def _falls(speeds_mps: FloatArray) -> Iterator[tuple[int, int]]:
    """Yield the first and last index of stretches in which a speed falls, but for noise."""
    start, last = 0, len(speeds_mps) - 1
    while start < last:
        end = lowest = start
        while end < last and speeds_mps[end + 1] <= speeds_mps[lowest] + _NOISE_MPS:
            end += 1
            lowest = end if speeds_mps[end] < speeds_mps[lowest] else lowest
        if lowest > start:
            yield start, lowest
        start = max(end, start + 1)
