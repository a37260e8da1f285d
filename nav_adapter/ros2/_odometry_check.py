"""Contradictions between the poses of odometry, its twists, and tf."""

from __future__ import annotations

import math
from collections import deque
from typing import Final, NamedTuple

import numpy as np

from perception.arrays import FloatArray

from .._errors import NavError
from .._robot import RobotState
from ._outgoing import Frames
from ._transforms import TransformBuffer

# The motion of the last seconds is compared: long enough for noise to be small beside it.
_WINDOW_S: Final = 2.0
# Poses and twists of a longer pause are not compared.
_LONGEST_STEP_S: Final = 0.5
# Poses that move less show no motion: noise, or a robot that stands. The same is tolerated, and
# beside it a share of the motion for wheels that slip and filters that lag.
_LEAST_M: Final = 0.2
_LEAST_RAD: Final = 0.2
_SHARE: Final = 0.3
# Skid-steered robots turn less than their wheels say.
_TURN_SHARE: Final = 0.5
# A twist that claims so much of a robot that stands is in another unit.
_FARTHEST_M: Final = 10.0
# Odometry and tf of one source differ by rounding, and by their stamps: by what the robot drives
# in this time.
_APART_M: Final = 0.1
_APART_RAD: Final = 0.1
_STAMPS_S: Final = 0.1
# More often would cost more than it tells.
_COMPARED_EVERY_S: Final = 0.04
# A contradiction that has just ended may come again with the next motion. Each further one holds
# twice as long, up to a limit.
_HELD_S: Final = 2.0
_LONGEST_HELD_S: Final = 32.0
# Units other than metres per second.
_UNITS: Final = {"mm/s": 1000.0, "cm/s": 100.0, "km/h": 3.6}


class _Sample(NamedTuple):
    """The pose (2,), (3, 3) of the odometry's child frame in odom, and the motion since the first.

    The rates (5,) are x, y in odom; x, y as the twist has them; yaw rate. ``driven`` is their
    integral; the poses have turned about z.
    """

    stamp_s: float
    position_m: FloatArray
    rotation: FloatArray
    rates: FloatArray
    driven: FloatArray
    turned_rad: float


class OdometryCheck:
    """Compares the poses of odometry with its twists, and with tf.

    A contradiction lasts until 2 s have passed without one, the next one until 4 s have, and so on
    up to 32 s.

    Attributes:
        problem: the contradiction in words, empty for none.
    """

    def __init__(self, frames: Frames) -> None:
        self._frames = frames
        self._samples: deque[_Sample] = deque()
        self.problem, self._seen_s = "", -math.inf
        self._compared_s = -math.inf
        self._held_s = 0.0

    def add(
        self,
        stamp_s: float,
        T_odom_child: FloatArray,
        velocity_child_mps: FloatArray,
        turning_child_radps: FloatArray,
        child: str,
    ) -> None:
        """Compare the twists (3,) of the last 2 s with the motion of the poses of a child frame.

        A pause, or a clock that goes back, starts anew.
        """
        if not 0.0 <= stamp_s - self._seen_s <= self._held_s:
            self.problem = ""
        rotation = T_odom_child[:3, :3]
        velocity, turning = rotation @ velocity_child_mps, rotation @ turning_child_radps
        rates = np.array([*velocity[:2], *velocity_child_mps[:2], turning[2]])
        samples, driven, turned = self._samples, np.zeros(5), 0.0
        if samples and not 0.0 <= stamp_s - samples[-1].stamp_s <= _LONGEST_STEP_S:
            samples.clear()
        if samples:
            last = samples[-1]
            driven = last.driven + 0.5 * (stamp_s - last.stamp_s) * (last.rates + rates)
            turned = last.turned_rad + _yaw_rad(rotation @ last.rotation.T)
        samples.append(_Sample(stamp_s, T_odom_child[:2, 3], rotation, rates, driven, turned))
        while stamp_s - samples[0].stamp_s > _WINDOW_S:
            samples.popleft()
        first, last = samples[0], samples[-1]
        moved_m, claimed = last.position_m - first.position_m, last.driven - first.driven
        turned_rad = last.turned_rad - first.turned_rad
        found = _of_speed(moved_m, claimed, child, self._frames.odom) or _of_turn(
            turned_rad, float(claimed[4])
        )
        if found:
            self._report(stamp_s, f"poses and twists contradict each other: {found}")

    def compare(
        self, odometry: TransformBuffer, transforms: TransformBuffer, state: RobotState
    ) -> None:
        """Compare the latest pose of odometry that tf has too, at the latest ``state``."""
        odom, base = self._frames.odom, self._frames.base
        if 0.0 <= state.stamp_s - self._compared_s < _COMPARED_EVERY_S:
            return
        self._compared_s = state.stamp_s
        try:
            if min(len(way) for way in transforms.ways(odom, base)) > 1:
                return  # by way of a map: localisation, which may differ
            stamp_s = min(state.stamp_s, transforms.latest_s(odom, base))
            T_tf, T = (each.lookup(odom, base, stamp_s) for each in (transforms, odometry))
        except NavError:
            return  # tf has no pose of the robot, or none of this time
        apart_m = math.hypot(*(T_tf[:2, 3] - T[:2, 3]))
        apart_rad = abs(_yaw_rad(T_tf[:3, :3] @ T[:3, :3].T))
        if (
            apart_m > _APART_M + _STAMPS_S * state.travel_mps
            or apart_rad > _APART_RAD + _STAMPS_S * abs(state.yaw_rate_radps)
        ):
            self._report(
                state.stamp_s,
                f"odometry and tf contradict each other: their poses of {base!r} in {odom!r} are "
                f"{apart_m:.2f} m and {math.degrees(apart_rad):.0f}° apart, ({T[0, 3]:.2f}, "
                f"{T[1, 3]:.2f}) m in odometry and ({T_tf[0, 3]:.2f}, {T_tf[1, 3]:.2f}) m in tf: "
                "read the odometry of the node that publishes this transform",
            )

    def _report(self, stamp_s: float, problem: str) -> None:
        """Keep the words of the first sight, so that one contradiction is reported once."""
        if not self.problem:
            self._held_s = min(max(2.0 * self._held_s, _HELD_S), _LONGEST_HELD_S)
        self.problem, self._seen_s = self.problem or problem, stamp_s


def _of_speed(moved_m: FloatArray, claimed: FloatArray, child: str, odom: str) -> str:
    """Return how the speeds contradict the poses, which moved by (2,); empty if they do not.

    The twists of the child frame claim (4 or more,): in odom, and as they are.
    """
    way_m, claimed_m = math.hypot(*moved_m), math.hypot(*claimed[:2])
    most_m = _LEAST_M + _SHARE * way_m

    def fits(other_m: FloatArray) -> bool:
        return math.hypot(*(other_m - moved_m)) <= most_m

    if (way_m < _LEAST_M and claimed_m < _FARTHEST_M) or fits(claimed[:2]):
        return ""
    causes = []
    if fits(claimed[2:4]):
        causes.append(f"in frame {odom!r} instead of the child frame {child!r}")
    if fits(-claimed[:2]):
        causes.append("of the wrong sign")
    if claimed_m < _SHARE * way_m:
        causes.append("(nearly) 0 although the robot moves")
    if claimed_m > 2.0 * way_m:  # a short way fits a claim of nothing too
        causes += [f"in {unit}" for unit, per in _UNITS.items() if fits(claimed[:2] / per)]
    return (
        f"the robot moved by ({moved_m[0]:.2f}, {moved_m[1]:.2f}) m in {odom!r}, by its twists by "
        f"({claimed[0]:.2f}, {claimed[1]:.2f}) m; the twist seems to be "
        f"{' or '.join(causes) or 'that of another motion'}"
    )


def _of_turn(turned_rad: float, claimed_rad: float) -> str:
    """Return how the yaw rates contradict the poses; empty if they do not."""
    apart_rad = abs(turned_rad - claimed_rad)
    if abs(turned_rad) < _LEAST_RAD or apart_rad <= _LEAST_RAD + _TURN_SHARE * abs(turned_rad):
        return ""
    return (
        f"the robot turned by {math.degrees(turned_rad):.0f}°, by its yaw rates by "
        f"{math.degrees(claimed_rad):.0f}°"
    )


def _yaw_rad(turn: FloatArray) -> float:
    """Return the turn about z of a rotation (3, 3) that is small about the other axes."""
    return math.atan2(turn[1, 0], turn[0, 0])
