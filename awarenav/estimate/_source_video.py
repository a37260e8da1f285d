"""A video file, a camera or a stream as a source of frames, through OpenCV."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import cv2

from perception import Camera

from ..errors import AwarenavError, counted
from ._containers import lists_frames, missing_bytes
from ._exif import UPRIGHT
from ._images import as_rgb
from ._source import SourceFrame

# Lists of frames have some that cannot be decoded: so many may be missing.
_MISCOUNTED_FRAMES: Final = 2
_MISCOUNTED_SHARE: Final = 0.01
# EXIF's numbers for the turns, in degrees, that OpenCV has made as a video file asks for.
_ORIENTATIONS: Final = {90: 6, 180: 3, 270: 8}


class VideoSource:
    """Frames of a ``cv2.VideoCapture``: a file, a camera or a stream.

    The stamps of a file are those of its frames, also at a variable rate; those of a live source
    are the time since it was opened.

    Args:
        name: of the source, for messages.
        capture: the opened capture.
        live: whether it is a camera or a stream, which ends only if something is wrong.

    Raises:
        AwarenavError: if the capture is not open.
    """

    def __init__(self, name: str, capture: cv2.VideoCapture, *, live: bool) -> None:
        if not capture.isOpened():
            what = "camera or stream" if live else "video"
            hint = (
                "is it plugged in, not in use, and its number right?"
                if live
                else "it may be damaged, cut off, or of a format that OpenCV cannot decode"
            )
            raise AwarenavError(f"cannot open {what} {name}: {hint}")
        self._name = name
        self._capture = capture
        self.live = live
        self.rendered = False
        self.camera: Camera | None = None
        self.rectified = False
        self.notes: tuple[str, ...] = ()
        count = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        stated = not live and 0 < count < 1e9 and lists_frames(Path(name))
        self.count: int | None = int(count) if stated else None
        rate = capture.get(cv2.CAP_PROP_FPS)
        turn_deg = 0 if live else int(capture.get(cv2.CAP_PROP_ORIENTATION_META)) % 360
        self._orientation = _ORIENTATIONS.get(turn_deg, UPRIGHT)
        self.rate_hz: float | None = rate if math.isfinite(rate) and 0.1 <= rate <= 1000.0 else None

    @classmethod
    def of_file(cls, path: str) -> VideoSource:
        """Open a video file."""
        return cls(path, _open_silently(path), live=False)

    @classmethod
    def of_camera(cls, index: int) -> VideoSource:
        """Open a camera of this computer by its number."""
        return cls(str(index), _open_silently(index), live=True)

    @classmethod
    def of_stream(cls, address: str) -> VideoSource:
        """Open a network stream such as ``rtsp://…``."""
        return cls(address, _open_silently(address), live=True)

    def frames(self) -> Iterator[SourceFrame]:
        """Yield frames numbered from 000000; after an early end, a frame with a ``problem``."""
        period_s = 1.0 / (self.rate_hz or 30.0)
        start_s, last_s, number = time.monotonic(), -math.inf, 0
        while True:
            good, image = self._capture.read()
            if not good or image is None:
                break
            if self.live:
                stamp_s = time.monotonic() - start_s
            else:
                stamp_s = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
            # Containers without stamps give 0 for every frame; then only the rate is known.
            if not math.isfinite(stamp_s) or stamp_s <= last_s:
                stamp_s = 0.0 if number == 0 else last_s + period_s
            last_s = stamp_s
            name = f"{number:06d}"
            try:
                picture = as_rgb(image, f"{self._name}, frame {name}")
                yield SourceFrame(name, stamp_s, picture, orientation=self._orientation)
            except AwarenavError as error:
                yield SourceFrame(name, stamp_s, None, None, str(error))
            number += 1
        problem = self._early_end(number)
        if problem:
            yield SourceFrame(f"{number:06d}", max(last_s, 0.0), None, None, problem)

    def close(self) -> None:
        """Release the device or file."""
        self._capture.release()

    def _early_end(self, read: int) -> str:
        """Return why the source ended too early after ``read`` frames; empty if it did not."""
        if self.live:
            return f"{self._name} stopped delivering after {counted(read, 'frame')} (unplugged?)"
        if read == 0:
            return f"{self._name} has no frame that can be decoded"
        if self.count is None:
            lost = missing_bytes(Path(self._name))
            what = f"{self._name} ends after {counted(read, 'frame')}: it is cut off"
            return f"{what}, {lost} bytes are missing" if lost else ""
        missing = self.count - read
        if missing <= max(_MISCOUNTED_FRAMES, _MISCOUNTED_SHARE * self.count):
            return ""
        frames = counted(self.count, "frame")
        return f"{self._name} ends after {read} of {frames}: it is cut off or damaged"


def _open_silently(what: str | int) -> cv2.VideoCapture:
    """Open a capture without OpenCV's own messages on standard error."""
    logging = getattr(cv2, "utils", None) and getattr(cv2.utils, "logging", None)
    if logging is None:
        return cv2.VideoCapture(what)
    level = logging.getLogLevel()
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    try:
        return cv2.VideoCapture(what)
    finally:
        logging.setLogLevel(level)
