"""Pictures of an episode's worst instant: the image of the robot's camera, and the plan."""

from __future__ import annotations

import base64
import contextlib
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ...crossing import CrossingFrame, Stage, TopView, camera_view
from ..measures import EpisodeRecord
from ..runs import Job, box_scale_of, observed_episode

_WIDTH_PX: Final = 540
_JPEG_QUALITY: Final = 80
# Width of the area that the plan shows.
_WINDOW_M: Final = 10.0
# Paths are drawn through every fourth frame.
_PATH_STEP: Final = 4
# Tolerance for margins from a table, which has six decimals.
_SAME_M: Final = 1e-5

Image = NDArray[np.uint8]


class _Drawn(Exception):  # noqa: N818 - no error
    """Ends the episode after its worst instant has been drawn."""


class _WorstInstant:
    """An observer that draws the first instant at which a moving robot's margin is this small."""

    def __init__(self, margin_m: float, box_scale: float) -> None:
        self._margin_m = margin_m
        self._box_scale = box_scale
        self._frames: list[CrossingFrame] = []
        self.least_m = float("inf")
        self.camera: Image | None = None
        self.plan: Image | None = None
        self.t_s = 0.0

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        self._frames.append(frame)
        self.least_m = min(self.least_m, frame.margin_m)
        if self.least_m <= self._margin_m + _SAME_M:
            self._draw(frame, stage)
            raise _Drawn

    def _draw(self, frame: CrossingFrame, stage: Stage) -> None:
        spec = stage.scenario.camera
        size_px = _WIDTH_PX, round(_WIDTH_PX / spec.width_px * spec.height_px)
        worker = int(np.argmin(frame.margins_m))
        middle = 0.5 * (frame.robot_state.position_odom_m + frame.truth[worker].position_odom_m)
        view = TopView(stage, size_px, _window(middle, size_px))
        for earlier in self._frames:
            view.watch(earlier)
        for earlier in self._frames[:-1:_PATH_STEP]:
            view.draw(earlier, stage)  # extends the paths
        self.plan = view.draw(frame, stage)
        how = {"box_scale": self._box_scale, "memory": view.memory}
        self.camera = camera_view(frame, stage, _WIDTH_PX, **how)
        self.t_s = frame.t_s


def pictures_of(job: Job, record: EpisodeRecord) -> tuple[tuple[tuple[str, str], ...], str]:
    """Run an episode again up to its smallest margin, and draw that instant.

    Returns:
        Pictures as ``data:`` addresses, each with a description, and a message about trouble,
        empty without trouble.
    """
    if record.min_margin_m is None:
        return (), "No picture: the robot never moved near anybody."
    instant = _WorstInstant(record.min_margin_m, box_scale_of(job))
    with contextlib.suppress(_Drawn):
        observed_episode(job, instant)
    if instant.camera is None or instant.plan is None:
        return (), (
            f"No picture: run again, the smallest margin was {instant.least_m:.2f} m. This "
            "installation does not repeat the run."
        )
    when = f"at {instant.t_s:.2f} s"
    return (
        (_data_address(instant.camera, ".jpg"), f"What the robot's camera saw {when}"),
        (_data_address(instant.plan, ".png"), f"Robot and people from above {when}"),
    ), ""


def _window(
    middle_odom_m: FloatArray, size_px: tuple[int, int]
) -> tuple[float, float, float, float]:
    """Return x_min, y_min, x_max, y_max (m) of the area that the plan shows."""
    x, y = middle_odom_m.tolist()
    half_x = 0.5 * _WINDOW_M
    half_y = half_x * size_px[1] / size_px[0]
    return x - half_x, y - half_y, x + half_x, y + half_y


def _data_address(picture: Image, ending: str) -> str:
    """Return an image as a ``data:`` address."""
    options = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY] if ending == ".jpg" else []
    _, data = cv2.imencode(ending, cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), options)
    kind = {".jpg": "jpeg", ".png": "png"}[ending]
    return f"data:image/{kind};base64,{base64.b64encode(data.tobytes()).decode()}"
