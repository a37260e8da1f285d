"""From what the user typed to a source of frames."""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Final

from ..errors import AwarenavError
from ._source import PICTURE_SUFFIXES, ImageSource
from ._source_pictures import PictureSource
from ._source_video import VideoSource

_BAG_SUFFIXES: Final = (".bag", ".db3", ".mcap")
_STREAM: Final = re.compile(r"^[a-z][a-z0-9+.-]*://")


def open_source(text: str, *, topic: str | None = None, interval_s: float = 1.0) -> ImageSource:
    """Open an image, a folder of images, a video, a camera, a stream or a recording.

    Args:
        text: a path, a camera's number such as ``0``, or an address such as ``rtsp://…``.
        topic: the image topic of a recording; None is the only one there is.
        interval_s: between pictures of a folder that does not say when they were taken.

    Raises:
        AwarenavError: when there is nothing there, or nothing that can be read.
    """
    if text.isdigit() and not Path(text).exists():
        return VideoSource.of_camera(int(text))
    if _STREAM.match(text):
        return VideoSource.of_stream(text)
    path = Path(text)
    if not path.exists():
        raise AwarenavError(
            f"no such file or folder: {text}{_nearest(path)}; SOURCE is an image, a folder of "
            "images, a video, a camera's number, a stream's address or a ROS recording"
        )
    recording = path.suffix.lower() in _BAG_SUFFIXES or (path / "metadata.yaml").exists()
    if recording:
        from ._source_bag import BagSource  # noqa: PLC0415 - an optional dependency

        return BagSource(path, topic)
    if topic is not None:
        raise AwarenavError(f"--topic is for ROS recordings, and {text} is none")
    if path.is_dir() or path.suffix.lower() in PICTURE_SUFFIXES:
        return PictureSource(path, interval_s)
    return VideoSource.of_file(text)


def _nearest(path: Path) -> str:
    if not path.parent.is_dir():
        return ""
    near = difflib.get_close_matches(path.name, [each.name for each in path.parent.iterdir()], n=1)
    return f" (did you mean {path.parent / near[0]}?)" if near else ""
