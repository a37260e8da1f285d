"""Portraits of the worker for the film, taken while a crossing runs."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np

from perception.arrays import ImageRgb

from ..crossing import CrossingFrame, Stage
from ..scenario import Scenario
from ..world import sees
from ..world.camera import CameraRenderer

#: Pictures per second; the film runs at the speed of the crossing.
FILM_HZ: Final = 10
#: Width and height of the worker's portrait, pixels.
PORTRAIT_PX: Final = (136, 150)
# Height of the part of the hall, at the worker's distance, that a portrait shows.
_PORTRAIT_HEIGHT_M: Final = 0.75
_PORTRAIT_BELOW_EYES_M: Final = 0.14


class PortraitRecorder:
    """An observer of a crossing that takes the pictures of the first worker for the film.

    A portrait is a part of the image of the robot's camera, with more pixels.

    Args:
        scenario: the scenario of the crossing.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._camera = scenario.camera.camera()
        self._every = max(round(scenario.control_hz / FILM_HZ), 1)
        self._cycles = 0
        self._portraits: list[ImageRgb | None] = []

    @property
    def portraits(self) -> tuple[ImageRgb | None, ...]:
        """The portraits, one per picture of the film; None where the camera sees no worker."""
        return tuple(self._portraits)

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        if self._cycles % self._every == 0:
            self._portraits.append(self._portrait(frame, stage))
        self._cycles += 1

    def _portrait(self, frame: CrossingFrame, stage: Stage) -> ImageRgb | None:
        T = frame.T_odom_camera
        robot = frozenset({stage.amr.body})
        if not stage.workers or not sees(stage.workers[0], T[:3, 3], through=robot):
            return None
        middle = (stage.workers[0].eyes_odom_m - T[:3, 3]) @ T[:3, :3]
        middle[1] += _PORTRAIT_BELOW_EYES_M
        if middle[2] <= 0.1:
            return None
        (u, v) = self._camera.project(middle[None])[0].tolist()
        if not 0.0 <= u <= self._camera.width_px:
            return None
        half_height = 0.5 * _PORTRAIT_HEIGHT_M * self._camera.fy_px / middle[2]
        half_width = half_height * PORTRAIT_PX[0] / PORTRAIT_PX[1]
        part = (u - half_width, v - half_height, u + half_width, v + half_height)
        size = (2 * PORTRAIT_PX[0], 2 * PORTRAIT_PX[1])
        view = CameraRenderer(stage.warehouse).render(self._camera, T, part, size)
        small = cv2.resize(view.rgb, PORTRAIT_PX, interpolation=cv2.INTER_AREA)
        return np.asarray(small, np.uint8)
