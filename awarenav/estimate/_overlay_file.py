"""Where drawn pictures go: a video or a folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from perception import AttentionCone
from perception.arrays import ImageRgb

from ..closing import Closing
from ..errors import AwarenavError
from ._estimator import FrameEstimate
from ._overlay import draw_overlay
from ._source import PICTURE_SUFFIXES

if TYPE_CHECKING:
    from ..video import VideoWriter


# Nobody who names one of these wants a folder of that name.
_OTHER_FILES: Final = (*PICTURE_SUFFIXES, ".avi", ".gif", ".mkv", ".mov", ".webm")


class OverlayFile(Closing):
    """Draws estimates into a video (``.mp4``), a folder of pictures, or one picture file.

    A video has one size, that of its first picture; pictures of another are fitted in. It appears
    when it is complete, or interrupted, and is then a playable video.

    Args:
        path: of the video, the folder (which is made) or, for ``single``, the picture.
        rate_hz: frames a second of a video.
        cone: the attention cone.
        single: there is one picture, so a picture file will do.

    Raises:
        AwarenavError: for a path that is none of these, or a video where PyAV is not installed.
    """

    def __init__(
        self, path: Path, rate_hz: float, cone: AttentionCone, *, single: bool = False
    ) -> None:
        self._path = path
        self._rate_hz = max(round(rate_hz), 1)
        self._cone = cone
        self._video: VideoWriter | None = None
        self._size_px = (0, 0)
        suffix = path.suffix.lower()
        self._is_video = suffix == ".mp4"
        self._is_file = self._is_video or (single and suffix in PICTURE_SUFFIXES)
        if suffix in _OTHER_FILES and not self._is_file and not path.is_dir():
            one = " or, for one image, a picture file" if single else ""
            raise AwarenavError(
                f"--overlay must be a .mp4 file, a folder{one} or 'none', got {path}"
            )
        if self._is_video:
            _video_writer()  # what is missing is said before anything is estimated
        folder = path.parent if self._is_file else path
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as cause:
            raise AwarenavError(
                f"cannot make the folder {folder}: {cause.strerror or cause}"
            ) from cause

    def add(self, estimate: FrameEstimate) -> None:
        """Draw one estimate and append it."""
        image = draw_overlay(estimate, self._cone)
        if self._is_video:
            if self._video is None:
                # H.264 in yuv420p has even sides.
                width, height = image.shape[1], image.shape[0]
                self._size_px = width + width % 2, height + height % 2
                self._video = _video_writer()(self._path, self._rate_hz, self._size_px)
            self._video.add(fit(image, *self._size_px))
        elif self._is_file:
            _write_picture(self._path, image)
        else:
            _write_picture(self._path / f"{Path(estimate.frame.name).stem}.png", image)

    def close(self) -> None:
        """Finish a video."""
        if self._video is not None:
            self._video.close()


def _video_writer() -> type[VideoWriter]:
    try:
        from ..video import VideoWriter  # noqa: PLC0415 - PyAV is an optional dependency
    except ImportError as cause:
        raise AwarenavError(
            "drawing into a video needs PyAV, which is not installed: pip install av; or draw into "
            "a folder (--overlay DIR)"
        ) from cause
    return VideoWriter


def _write_picture(path: Path, image: ImageRgb) -> None:
    """Write a picture whole or not at all."""
    part = path.with_name(path.name + ".part")
    try:
        good, data = cv2.imencode(path.suffix, image[..., ::-1])
        if not good:
            raise OSError("it cannot be encoded")
        part.write_bytes(data.tobytes())
        part.replace(path)
    except (OSError, cv2.error) as cause:
        raise AwarenavError(f"cannot write {path}: {cause}") from cause


def fit(image: ImageRgb, width_px: int, height_px: int) -> ImageRgb:
    """Put a picture in the middle of one of another size, shrunk when it does not fit."""
    height, width = image.shape[:2]
    if (width, height) == (width_px, height_px):
        return image
    scale = min(width_px / width, height_px / height, 1.0)
    if scale < 1.0:
        width, height = max(round(width * scale), 1), max(round(height * scale), 1)
        image = np.asarray(
            cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8
        )
    canvas = np.zeros((height_px, width_px, 3), np.uint8)
    top, left = (height_px - height) // 2, (width_px - width) // 2
    canvas[top : top + height, left : left + width] = image
    return canvas
