"""Odometry that is delayed, lost, or wrong about the mounting of the camera."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from nav_adapter import RobotState
from perception.arrays import FloatArray

from ._fault import Fault

# Tolerance for times that are sums of many steps.
_EARLY_S: Final = 1.0e-6


@dataclass(frozen=True, slots=True, eq=False)
class OdometryReading:
    """An odometry message: the robot's state, and the pose of its camera (4, 4)."""

    state: RobotState
    T_odom_camera: FloatArray


class FaultyOdometry:
    """The robot's odometry with a fault.

    Args:
        fault: the fault.
        T_camera_assumed: (4, 4) pose of the camera as the robot assumes it, in the true camera's
            frame; None where they are the same.
        rng: random generator of the first outage's time.
    """

    def __init__(
        self, fault: Fault, T_camera_assumed: FloatArray | None, rng: np.random.Generator
    ) -> None:
        self._fault = fault
        self._T_camera_assumed = T_camera_assumed
        self._first_outage_s = float(rng.uniform(0.0, fault.lost_odometry.every_s))
        self._arriving: deque[OdometryReading] = deque()
        self._known: OdometryReading | None = None

    def update(self, state: RobotState, T_odom_camera: FloatArray) -> OdometryReading:
        """Take the true state; return what the robot knows then. Stamps grow from call to call."""
        now_s = state.stamp_s
        self._arriving.append(OdometryReading(state, T_odom_camera))
        outage = self._fault.lost_odometry
        lost = outage.holds(now_s, self._first_outage_s)
        latest_s = now_s - self._fault.odometry_delay_s + _EARLY_S
        while self._arriving and self._arriving[0].state.stamp_s <= latest_s:
            message = self._arriving.popleft()
            if not lost or self._known is None:
                self._known = message
        # Before the first message has arrived, the robot knows its start.
        known = self._arriving[0] if self._known is None else self._known
        if lost and outage.fresh_stamps:
            known = replace(known, state=replace(known.state, stamp_s=now_s))
        if self._T_camera_assumed is None:
            return known
        return replace(known, T_odom_camera=known.T_odom_camera @ self._T_camera_assumed)
