"""Draws estimates into their images, and these into a video, a folder or a file."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from perception import AttentionCone
from perception.arrays import ImageRgb

from ..errors import AwarenavError, MissingExtraError
from ..files import atomic_path, require_writable
from ..overlay import OverlaidPerson, draw_people
from ._estimator import FrameEstimate
from ._pictures import IMAGE_SUFFIXES

if TYPE_CHECKING:
    from ..video import VideoWriter

# A folder with one of these suffixes would be a mistake.
_FILE_SUFFIXES: Final = (*IMAGE_SUFFIXES, ".avi", ".gif", ".mkv", ".mov", ".webm")


def draw_overlay(estimate: FrameEstimate, cone: AttentionCone) -> ImageRgb:
    """Draw the people of an estimate into its image, with a caption.

    Args:
        estimate: of a frame that has an image.
        cone: the attention cone.

    Returns:
        A new image of the same size.
    """
    assert estimate.frame.image_rgb is not None
    tracks = {track.id: track for track in estimate.tracks or ()}
    people = [
        OverlaidPerson(seen, seen.keypoints, None if track_id is None else tracks.get(track_id))
        for seen, track_id in zip(estimate.observations, estimate.track_ids, strict=True)
    ]
    caption = f"{estimate.frame.stamp_s:.2f} s · {_counted(len(people))}"
    if estimate.unfit:
        caption += " · made for renders, do not trust"
    return draw_people(estimate.frame.image_rgb, estimate.camera, people, cone, caption)


def _counted(people: int) -> str:
    return "nobody" if not people else "1 person" if people == 1 else f"{people} people"


class OverlayWriter(AbstractContextManager["OverlayWriter"]):
    """Draws estimates into a video (``.mp4``), a folder of images, or one image file.

    A video has the size of its first image; images of another size are fitted into it. The video
    appears when it is closed; an interrupted one can be played too.

    Args:
        path: of the video, the folder (which is made) or, with ``single``, the image file.
        rate_hz: frames per second of a video.
        cone: the attention cone.
        single: whether there is only one image, which may go into an image file.

    Raises:
        AwarenavError: for a path that is none of these, or a video if PyAV is not installed.
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
        self._is_file = self._is_video or (single and suffix in IMAGE_SUFFIXES)
        if suffix in _FILE_SUFFIXES and not self._is_file and not path.is_dir():
            single_file = " or, for one image, an image file" if single else ""
            raise AwarenavError(
                f"--overlay must be a .mp4 file, a folder{single_file} or 'none', got {path}"
            )
        if self._is_video:
            _video_writer()  # fails before the first estimate if PyAV is not installed
        require_writable(path.parent if self._is_file else path)

    def add(self, estimate: FrameEstimate) -> None:
        """Draw an estimate and write the image."""
        image = draw_overlay(estimate, self._cone)
        if self._is_video:
            if self._video is None:
                # The sides of a yuv420p video are even.
                width, height = image.shape[1], image.shape[0]
                self._size_px = width + width % 2, height + height % 2
                self._video = _video_writer()(self._path, self._rate_hz, self._size_px)
            self._video.add(fit_image(image, *self._size_px))
        elif self._is_file:
            _write_image(self._path, image)
        else:
            _write_image(self._path / f"{Path(estimate.frame.name).stem}.png", image)

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Finish the video, if there is one."""
        if self._video is not None:
            self._video.close()


def _video_writer() -> type[VideoWriter]:
    try:
        from ..video import VideoWriter  # noqa: PLC0415 - PyAV is an optional dependency
    except ImportError as cause:
        raise MissingExtraError(
            "drawing into a video needs PyAV, which is not installed: pip install av; or draw into "
            "a folder (--overlay DIR)"
        ) from cause
    return VideoWriter


def _write_image(path: Path, image: ImageRgb) -> None:
    try:
        good, data = cv2.imencode(path.suffix, image[..., ::-1])
    except cv2.error as cause:
        raise AwarenavError(f"cannot write {path}: {cause}") from cause
    if not good:
        raise AwarenavError(f"cannot write {path}: it cannot be encoded")
    with atomic_path(path) as part:
        part.write_bytes(data.tobytes())


def fit_image(image: ImageRgb, width_px: int, height_px: int) -> ImageRgb:
    """Return an image of another size with this one in its middle, shrunk if it is too large."""
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
