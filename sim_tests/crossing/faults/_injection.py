"""The parts of a fault in one episode: eyes, odometry, and the assumed mounting of the camera."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray

from ..eyes import TimedEyes
from ._fault import Fault
from ._frames import FaultyEyes
from ._odometry import FaultyOdometry

# Random streams of faults are separate from all others of an episode.
_STREAM: Final = 0xFA017


class FaultInjection:
    """A fault in one episode.

    Args:
        fault: the fault; None for none.
        seed: seed of the episode.

    Attributes:
        T_camera_assumed: (4, 4) pose of the camera as the robot assumes it, in the true camera's
            frame; None where they are the same.
    """

    def __init__(self, fault: Fault | None, seed: int) -> None:
        self._fault = Fault() if fault is None else fault
        self._eyes_rng, self._odometry_rng = np.random.default_rng([_STREAM, seed]).spawn(2)
        self.T_camera_assumed = _mounting_error(self._fault)

    def eyes(self, eyes: TimedEyes, camera: Camera) -> FaultyEyes:
        """Return the eyes with the fault."""
        return FaultyEyes(self._fault, eyes, camera, self._eyes_rng)

    def odometry(self) -> FaultyOdometry:
        """Return the robot's odometry with the fault."""
        return FaultyOdometry(self._fault, self.T_camera_assumed, self._odometry_rng)


def _mounting_error(fault: Fault) -> FloatArray | None:
    """Return rotations about the optical axes x (positive looks up) and y (negative looks left)."""
    pitch, yaw = math.radians(fault.pitch_error_deg), -math.radians(fault.yaw_error_deg)
    if pitch == yaw == 0.0:
        return None
    cos_p, sin_p, cos_y, sin_y = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos_p, -sin_p], [0.0, sin_p, cos_p]])
    about_y = np.array([[cos_y, 0.0, sin_y], [0.0, 1.0, 0.0], [-sin_y, 0.0, cos_y]])
    transform = np.eye(4)
    transform[:3, :3] = about_y @ about_x
    return transform
