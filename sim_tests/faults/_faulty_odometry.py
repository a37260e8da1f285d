"""Odometry that comes late or not at all."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from nav_adapter import RobotState
from perception.arrays import FloatArray

from ._fault import Fault

# Slack for times that are sums of many steps.
_EARLY_S: Final = 1.0e-6


@dataclass(frozen=True, slots=True, eq=False)
class Odometry:
    """What the robot knows about itself: its state, and where its camera is (4, 4)."""

    state: RobotState
    T_odom_camera: FloatArray


class FaultyOdometry:
    """Turns the truth about the robot into what the robot knows.

    Args:
        fault: what is wrong.
        T_camera_assumed: (4, 4) the camera as it is believed to be mounted, in the true camera's
            frame; None where it is mounted as believed.
        rng: of the first outage's time.
    """

    def __init__(
        self, fault: Fault, T_camera_assumed: FloatArray | None, rng: np.random.Generator
    ) -> None:
        self._fault = fault
        self._T_camera_assumed = T_camera_assumed
        self._first_outage_s = float(rng.uniform(0.0, fault.lost_odometry.every_s))
        self._arriving: deque[Odometry] = deque()
        self._known: Odometry | None = None

    def known(self, state: RobotState, T_odom_camera: FloatArray) -> Odometry:
        """What the robot knows at the stamp of its true state; stamps rise from call to call."""
        now_s = state.stamp_s
        self._arriving.append(Odometry(state, T_odom_camera))
        outage = self._fault.lost_odometry
        lost = outage.holds(now_s, self._first_outage_s)
        latest_s = now_s - self._fault.odometry_delay_s + _EARLY_S
        while self._arriving and self._arriving[0].state.stamp_s <= latest_s:
            arrived = self._arriving.popleft()
            if not lost or self._known is None:
                self._known = arrived
        # Before the first message has come, the robot stands where it was switched on.
        known = self._arriving[0] if self._known is None else self._known
        if lost and outage.fresh_stamps:
            known = replace(known, state=replace(known.state, stamp_s=now_s))
        if self._T_camera_assumed is None:
            return known
        return replace(known, T_odom_camera=known.T_odom_camera @ self._T_camera_assumed)
