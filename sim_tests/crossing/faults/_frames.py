"""Odometry that comes late or not at all.

Frames that are lost, late, frozen or wrongly placed on their way to the tracker.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from nav_adapter import RobotState
from perception import Camera
from perception.arrays import FloatArray

from ...world.camera import CameraTiming, FrameQueue
from .._stage import TrueView
from ..eyes import Sighting, TimedEyes
from ._detections import FaultyDetections
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


# Own streams, whatever else an episode draws from its seed.
_STREAM = 0xFA017


class FaultyEyes:
    """Stands between the robot's eyes and its tracker and does what a fault says.

    Args:
        fault: what is wrong.
        eyes: that work.
        camera: of the robot.
        rng: of all that is drawn here.
    """

    def __init__(
        self, fault: Fault, eyes: TimedEyes, camera: Camera, rng: np.random.Generator
    ) -> None:
        detection_rng, self._timing_rng, freeze_rng = rng.spawn(3)
        self._eyes = eyes
        self._detections = FaultyDetections(fault, camera, detection_rng)
        self._freeze = fault.frozen_camera
        self._first_freeze_s = float(freeze_rng.uniform(0.0, self._freeze.every_s))
        self._timing = CameraTiming(
            drop_rate=fault.drop_rate,
            latency_s=fault.latency_s,
            latency_jitter_s=fault.latency_jitter_s,
        )
        self._queue: FrameQueue[Sighting] = FrameQueue()
        self._poses: dict[float, tuple[FloatArray, FloatArray]] = {}
        self._last: Sighting | None = None

    def look(
        self,
        now_s: float,
        T_odom_camera: FloatArray,
        T_odom_camera_known: FloatArray,
        truth: tuple[TrueView, ...],
    ) -> tuple[Sighting, ...]:
        """What has arrived by now, in order of arrival.

        Args:
            now_s: later than before.
            T_odom_camera: (4, 4) where the camera is.
            T_odom_camera_known: (4, 4) where the robot believes that it is.
            truth: about every worker.
        """
        self._poses[now_s] = (T_odom_camera, T_odom_camera_known)
        for taken in self._eyes.look(now_s, T_odom_camera, truth):
            sighting = self._seen(taken)
            delivery_s = self._timing.delivery_s(now_s, self._timing_rng)
            if sighting is not None:
                self._queue.put(sighting.stamp_s, delivery_s, sighting)
        return self._queue.take(now_s)

    def _seen(self, taken: Sighting) -> Sighting | None:
        true, known = self._poses[taken.stamp_s]
        seen = self._detections.of(taken.seen, taken.stamp_s, true)
        if not self._freeze.holds(taken.stamp_s, self._first_freeze_s):
            self._last = Sighting(taken.stamp_s, known, seen)
            return self._last
        last = self._last
        if last is None or not self._freeze.fresh_stamps:
            return last
        again = tuple(
            (replace(observation, stamp_s=taken.stamp_s), index) for observation, index in last.seen
        )
        return Sighting(taken.stamp_s, known, again)


class FaultInjection:
    """All that a fault does in one episode.

    Args:
        fault: what is wrong; None for nothing.
        seed: of the episode.

    Attributes:
        T_camera_assumed: (4, 4) the camera as it is believed to be mounted, in the true camera's
            frame; None where it is mounted as believed.
    """

    def __init__(self, fault: Fault | None, seed: int) -> None:
        self._fault = Fault() if fault is None else fault
        self._eyes_rng, self._odometry_rng = np.random.default_rng([_STREAM, seed]).spawn(2)
        self.T_camera_assumed = _mounting_error(self._fault)

    def eyes(self, eyes: TimedEyes, camera: Camera) -> FaultyEyes:
        """Put the fault behind eyes."""
        return FaultyEyes(self._fault, eyes, camera, self._eyes_rng)

    def odometry(self) -> FaultyOdometry:
        """The robot's odometry under the fault."""
        return FaultyOdometry(self._fault, self.T_camera_assumed, self._odometry_rng)


def _mounting_error(fault: Fault) -> FloatArray | None:
    """Turns about the optical axes x (right; positive looks up) and y (down; negative left)."""
    pitch, yaw = math.radians(fault.pitch_error_deg), -math.radians(fault.yaw_error_deg)
    if pitch == yaw == 0.0:
        return None
    cos_p, sin_p, cos_y, sin_y = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos_p, -sin_p], [0.0, sin_p, cos_p]])
    about_y = np.array([[cos_y, 0.0, sin_y], [0.0, 1.0, 0.0], [-sin_y, 0.0, cos_y]])
    transform = np.eye(4)
    transform[:3, :3] = about_y @ about_x
    return transform
