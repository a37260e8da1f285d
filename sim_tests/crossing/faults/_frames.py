"""Images that are lost, late, frozen or wrongly placed on their way to the tracker."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray

from ...world.camera import CameraTiming, FrameQueue
from .._stage import TrueView
from ..eyes import Sighting, TimedEyes
from ._detections import FaultyDetections
from ._fault import Fault

# Tolerance for times that are sums of many steps.
_EARLY_S: Final = 1.0e-6


class FaultyEyes:
    """The robot's eyes with a fault.

    Args:
        fault: the fault.
        eyes: eyes without it.
        camera: camera of the robot.
        rng: random generator of the fault.
        black_s: from this time on, no image shows anything, and none arrives.
    """

    def __init__(
        self,
        fault: Fault,
        eyes: TimedEyes,
        camera: Camera,
        rng: np.random.Generator,
        *,
        black_s: float = math.inf,
    ) -> None:
        detection_rng, self._timing_rng, freeze_rng = rng.spawn(3)
        self._eyes, self._black_s = eyes, black_s
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
        """Take an image if one is due; return what has arrived by now, in order of arrival.

        Args:
            now_s: time; grows from call to call.
            T_odom_camera: (4, 4) true pose of the camera.
            T_odom_camera_known: (4, 4) pose of the camera that the robot assumes.
            truth: the truth about each person.
        """
        self._poses[now_s] = (T_odom_camera, T_odom_camera_known)
        while next(iter(self._poses)) < now_s - self._eyes.longest_delay_s - _EARLY_S:
            del self._poses[next(iter(self._poses))]  # no image of that time can still arrive
        for taken in self._eyes.look(now_s, T_odom_camera, truth):
            sighting = self._with_fault(taken)
            delivery_s = self._timing.delivery_s(now_s, self._timing_rng)
            if sighting is not None:
                self._queue.put(sighting.stamp_s, delivery_s, sighting)
        return self._queue.take(now_s)

    def _with_fault(self, taken: Sighting) -> Sighting | None:
        """Return the image that is delivered instead of the one taken; None for none."""
        true, known = self._poses[taken.stamp_s]
        observations = self._detections.apply(taken.observations, taken.stamp_s, true)
        if taken.stamp_s >= self._black_s:
            return None
        if not self._freeze.holds(taken.stamp_s, self._first_freeze_s):
            self._last = Sighting(taken.stamp_s, known, observations)
            return self._last
        last = self._last
        if last is None or not self._freeze.fresh_stamps:
            return last
        restamped = tuple(
            (replace(observation, stamp_s=taken.stamp_s), worker)
            for observation, worker in last.observations
        )
        return Sighting(taken.stamp_s, known, restamped)
