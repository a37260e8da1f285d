"""The film and the map of one episode."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception import AttentionCone

from .._closing import Closing
from .._crossing import CrossingFrame
from .._drawing import TopView, draw_camera_view
from .._stage import Stage
from .._video import VideoWriter
from ..pictures._renderer import CameraRenderer

Image = NDArray[np.uint8]

_VIDEO_HZ: Final = 10
_HEIGHT_PX: Final = 480
_MAP_WIDTH_PX: Final = 720
_MAP_MARGIN_M: Final = 3.0
_MAP_PX_PER_M: Final = 60.0


class ReplayPictures(Closing):
    """Films an episode and keeps the map of its closest moment, the paths of all drawn up to it.

    Args:
        map_path: PNG of the map.
        video_path: MP4, the robot's camera beside the map; None for none.

    Attributes:
        written: what has been written.
    """

    def __init__(self, map_path: Path, video_path: Path | None) -> None:
        self._map_path = map_path
        self._video_path = video_path
        self._cone = AttentionCone()
        self._view: TopView | None = None
        self._video: VideoWriter | None = None
        self._ticks = 0
        self._closest_m = float("inf")
        self._closest: Image | None = None
        self.written: list[Path] = []

    def close(self) -> None:
        """Finish the film; an interrupted one is still a film."""
        if self._video is not None:
            self._video.close()
            self._video = None

    def finish(self) -> None:
        """Write the map and finish the film."""
        self.close()
        if self._video_path is not None and self._video_path.exists():
            self.written.append(self._video_path)
        if self._closest is not None:
            cv2.imwrite(str(self._map_path), cv2.cvtColor(self._closest, cv2.COLOR_RGB2BGR))
            self.written.append(self._map_path)

    def add(self, frame: CrossingFrame, stage: Stage) -> None:
        """Take one control cycle."""
        every = max(round(stage.scenario.control_hz / _VIDEO_HZ), 1)
        number, self._ticks = self._ticks, self._ticks + 1
        nearest_m = min(frame.separations_m, default=float("inf"))
        closer = nearest_m < self._closest_m or self._closest is None
        if number % every and not closer:
            return
        if self._view is None:
            self._view = TopView(stage, (_MAP_WIDTH_PX, _HEIGHT_PX), _window(stage))
        above = self._view.draw(frame, stage, self._cone)
        if closer:
            self._closest_m, self._closest = nearest_m, above
        if self._video_path is not None and number % every == 0:
            self._film(frame, stage, above)

    def _film(self, frame: CrossingFrame, stage: Stage, above: Image) -> None:
        spec = stage.scenario.camera
        camera = spec.camera(_HEIGHT_PX / spec.height_px)
        picture = CameraRenderer(stage.warehouse).rgb(camera, frame.T_odom_camera)
        drawn = draw_camera_view(picture, camera, frame, stage, self._cone)
        both = np.hstack([drawn, above])
        both = both[:, : both.shape[1] // 2 * 2]
        if self._video is None:
            size = (both.shape[1], both.shape[0])
            self._video = VideoWriter(self._video_path, _VIDEO_HZ, size)  # type: ignore[arg-type]
        self._video.add(both)


def _window(stage: Stage) -> tuple[float, float, float, float]:
    """x_min, y_min, x_max, y_max (m): the robot's way and what is near it."""
    task = stage.scenario.robot
    xs, ys = (task.start_x_m, task.goal_x_m), (task.start_y_m, task.goal_y_m)
    return (
        min(xs) - _MAP_MARGIN_M,
        min(ys) - _MAP_MARGIN_M,
        max(xs) + _MAP_MARGIN_M,
        max(ys) + _MAP_MARGIN_M,
    )
