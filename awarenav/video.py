"""Writes H.264 video files with PyAV."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .closing import Closing
from .errors import AwarenavError, MissingExtraError

try:
    import av
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise MissingExtraError(
        "writing videos needs PyAV, which is not installed; it is part of the extra 'sim': "
        "pip install 'awarenav[sim]'"
    ) from cause


class VideoWriter(Closing):
    """An MP4 file that plays everywhere (H.264, yuv420p); it appears when it is complete.

    Args:
        path: the file, ending in ``.mp4``.
        rate_hz: frames a second.
        size_px: width and height, both even.
    """

    def __init__(self, path: Path, rate_hz: int, size_px: tuple[int, int]) -> None:
        if size_px[0] % 2 or size_px[1] % 2:
            raise AwarenavError(f"size_px must be even for yuv420p, got {size_px}")
        self._path = path
        self._partial = path.with_name(path.name + ".part")
        self._size_px = size_px
        self._container = av.open(str(self._partial), mode="w", format="mp4")
        self._stream = self._container.add_stream("libx264", rate=Fraction(rate_hz))
        self._stream.width, self._stream.height = size_px
        self._stream.pix_fmt = "yuv420p"
        self._stream.options = {"crf": "21", "preset": "veryfast"}

    def close(self) -> None:
        """Finish the file. An interrupted video is still a video."""
        for packet in self._stream.encode():
            self._container.mux(packet)
        self._container.close()
        self._partial.replace(self._path)

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Append one (H, W, 3) RGB picture."""
        if picture.shape != (self._size_px[1], self._size_px[0], 3):
            raise AwarenavError(f"pictures must be {self._size_px} px, got shape {picture.shape}")
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        for packet in self._stream.encode(frame):
            self._container.mux(packet)
