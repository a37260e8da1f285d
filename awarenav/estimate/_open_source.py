"""Opens the source of images that the user names."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from ..errors import AwarenavError, nearest_file
from ._pictures import IMAGE_SUFFIXES
from ._sources import ImageFiles, ImageSource, open_video

_BAG_SUFFIXES: Final = (".bag", ".db3", ".mcap")
#: A camera's number, as a source.
CAMERA_NUMBER: Final = re.compile("[0-9]{1,9}")
# Pictures of telephones that OpenCV does not decode.
_HEIF: Final = (".heic", ".heif")
_STREAM: Final = re.compile(r"^[a-z][a-z0-9+.-]*://")


def open_source(text: str, *, topic: str | None = None, fps: float | None = None) -> ImageSource:
    """Open an image, a folder of images, a video, a camera, a stream or a recording.

    Args:
        text: a path, the number of a camera such as ``0``, or an address such as ``rtsp://…``.
        topic: image topic of a recording; None if it has only one.
        fps: images per second of a folder without times; None if it is not known.

    Raises:
        AwarenavError: if there is no such source, or it cannot be read.
    """
    if fps is not None and not Path(text).is_dir():
        raise AwarenavError(f"--fps is for a folder of images without times; {text} is none")
    if _STREAM.match(text):
        return open_video(text, live=True)
    path = Path(text)
    try:
        exists = path.exists()
    except OSError as cause:
        raise AwarenavError(f"cannot read {text[:60]}…: {cause.strerror or cause}") from cause
    if not exists and CAMERA_NUMBER.fullmatch(text):
        return open_video(int(text), live=True)
    if not exists:
        near = nearest_file(path) or ";"
        raise AwarenavError(
            f"no such file or folder: {text}{near} SOURCE is an image, a folder of images, a "
            "video, the number of a camera, the address of a stream or a ROS recording"
        )
    if is_recording(path):
        from ._bag import BagSource  # noqa: PLC0415 - needs the extra rosbag

        if fps is not None:
            raise AwarenavError(
                f"--fps is for a folder of images; {text} is a recording with times"
            )
        return BagSource(path, topic)
    if topic is not None:
        raise AwarenavError(f"--topic is for ROS recordings; {text} is not one")
    if path.suffix.lower() in _HEIF:
        raise AwarenavError(f"{text} is an HEIF picture, which cannot be read: save it as JPEG")
    if path.is_dir() or path.suffix.lower() in IMAGE_SUFFIXES:
        return ImageFiles(path, fps)
    return open_video(text, live=False)


def is_recording(path: Path) -> bool:
    """Return whether a path is that of a ROS recording."""
    if path.is_dir():
        names = ("metadata.yaml", *(f"*{suffix}" for suffix in _BAG_SUFFIXES[1:]))
        return any(next(path.glob(name), None) for name in names)
    return path.suffix.lower() in _BAG_SUFFIXES
