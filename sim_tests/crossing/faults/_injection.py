"""The parts of a fault in one episode: eyes, odometry, scans, and the assumed mountings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray, ImageRgb
from perception.laser import Scanner

from ...world.scanner import ScannerSpec
from ..eyes import ScanChange, TimedEyes
from ._fault import Fault
from ._frames import FaultyEyes
from ._odometry import FaultyOdometry
from ._scanner_fault import ScannerFault
from ._scans import FaultyScans

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
        self._eyes_rng, self._odometry_rng, self._scans_rng, black_rng = np.random.default_rng(
            [_STREAM, seed]
        ).spawn(4)
        onset, draw = self._fault.black_camera, float(black_rng.random())
        self._black_s = math.inf if onset is None else onset.begins_s(draw)
        self.T_camera_assumed = _mounting_error(self._fault)

    def picture(self, rgb: ImageRgb, stamp_s: float) -> ImageRgb:
        """Return the picture (H, W, 3) that the camera delivers instead of one that it took."""
        return np.zeros_like(rgb) if stamp_s >= self._black_s else rgb

    def eyes(self, eyes: TimedEyes, camera: Camera, *, pictures: bool) -> FaultyEyes:
        """Return the eyes with the fault; with ``pictures`` they use :meth:`picture` themselves."""
        # Eyes without pictures have none to judge: a black one arrives as no frame, as it does
        # where the judgement of real pictures is used.
        black_s = math.inf if pictures else self._black_s
        return FaultyEyes(self._fault, eyes, camera, self._eyes_rng, black_s=black_s)

    def odometry(self) -> FaultyOdometry:
        """Return the robot's odometry with the fault."""
        return FaultyOdometry(self._fault, self.T_camera_assumed, self._odometry_rng)

    def scan_change(self, specs: Sequence[ScannerSpec]) -> ScanChange | None:
        """Return the change of scans on their way; None without one."""
        if self._fault.scanner == ScannerFault():
            return None
        return FaultyScans(self._fault, specs, self._scans_rng).change

    def mountings(
        self, specs: Sequence[ScannerSpec], body_base_m: FloatArray
    ) -> tuple[Scanner, ...]:
        """Return the mountings of the scanners as the robot assumes them.

        Args:
            specs: the scanners.
            body_base_m: (M, 2) outline of the robot in the base frame.
        """
        fault = self._fault.scanner
        return tuple(
            spec.model_copy(
                update={"yaw_deg": spec.yaw_deg + fault.yaw_error_deg}
                if fault.yaw_error_deg != 0.0 and fault.only in (None, number)
                else {}
            ).scanner(body_base_m)
            for number, spec in enumerate(specs, start=1)
        )


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
