"""The film of one crossing with three robots, side by side."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from awarenav.drawing import Font
from awarenav.errors import AwarenavError
from awarenav.video import VideoWriter
from perception.arrays import ImageRgb

from ..crossing import CrossingFrame, CrossingResult, Stage
from ..scenario import Scenario
from ..world import sees
from ..world.camera import CameraRenderer
from ._animated_image import AnimatedImageWriter
from ._film_panel import PANEL_PX, PORTRAIT_PX, draw_panel
from ._film_values import FilmRun

#: Pictures per second; the film runs at the speed of the crossing.
FILM_HZ: Final = 10
#: Time for which the last picture, with the results, is shown.
HOLD_S: Final = 4.0

_GAP_PX: Final = 12
_LEGEND_PX: Final = 34
_LEGEND: Final = (
    "circle: obstacle · cone: where the worker looks · outline: robot with nobody there"
    " · α: lower bound"
)
_LEGEND_FONT: Final = Font(24, weight=500)
# Height of the part of the hall, at the worker's distance, that a portrait shows.
_PORTRAIT_HEIGHT_M: Final = 0.75
_PORTRAIT_BELOW_EYES_M: Final = 0.14


def write_crossing_film(
    paths: Sequence[Path], runs: Sequence[FilmRun], free: CrossingResult
) -> None:
    """Write the film of crossings side by side, in real time; each panel stands still at its end.

    Args:
        paths: files to write, each ``.webp`` (animated image) or ``.mp4``.
        runs: the panels, from left to right.
        free: the crossing with nobody there, against which time is lost.

    Raises:
        AwarenavError: for another kind of file.
    """
    width, height = film_size_px(len(runs))
    with ExitStack() as stack:
        writers: list[VideoWriter | AnimatedImageWriter] = []
        for path in paths:
            if path.suffix not in (".webp", ".mp4"):
                raise AwarenavError(f"a film must be a .webp or .mp4 file, got {path}")
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.suffix == ".mp4":
                writers.append(stack.enter_context(VideoWriter(path, FILM_HZ, (width, height))))
            else:
                writers.append(
                    stack.enter_context(AnimatedImageWriter(path, FILM_HZ, (width, height), HOLD_S))
                )
        picture = None
        for picture in film_pictures(runs, free):
            for writer in writers:
                writer.add(picture)
        for writer in writers:
            if isinstance(writer, VideoWriter) and picture is not None:
                for _ in range(round(HOLD_S * FILM_HZ) - 1):
                    writer.add(picture)


def film_size_px(panels: int) -> tuple[int, int]:
    """Return width and height of a film, both even."""
    width = panels * (PANEL_PX[0] + _GAP_PX) + _GAP_PX
    height = PANEL_PX[1] + _GAP_PX + _LEGEND_PX
    return width + width % 2, height + height % 2


def film_pictures(runs: Sequence[FilmRun], free: CrossingResult) -> Iterator[ImageRgb]:
    """Yield the pictures of the film, from the start to the end of the longest crossing."""
    width, height = film_size_px(len(runs))
    end_s = max(run.result.frames[-1].t_s for run in runs)
    for number in range(math.ceil(end_s * FILM_HZ - 1e-6) + 1):
        image = np.full((height, width, 3), 255, np.uint8)
        for column, run in enumerate(runs):
            left = _GAP_PX + column * (PANEL_PX[0] + _GAP_PX)
            panel = draw_panel(run, free, number / FILM_HZ, number)
            image[_GAP_PX : _GAP_PX + PANEL_PX[1], left : left + PANEL_PX[0]] = panel
        _LEGEND_FONT.write(image, _LEGEND, (_GAP_PX + 8, height - _LEGEND_PX), (96, 100, 110))
        yield image


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
