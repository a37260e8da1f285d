"""H.264 video files, written with PyAV."""

from __future__ import annotations

from contextlib import AbstractContextManager
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from perception.installation import install_command

from .errors import AwarenavError, MissingExtraError

try:
    import av
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise MissingExtraError(
        "writing videos needs PyAV, which is not installed; it is part of the extra 'sim': "
        + install_command("sim")
    ) from cause


class VideoWriter(AbstractContextManager["VideoWriter"]):
    """An MP4 file that common players can play (H.264, yuv420p); it appears when it is closed.

    Args:
        path: of the file, which ends in ``.mp4``.
        rate_hz: frames per second.
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

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Finish the file; a video that was interrupted can be played too."""
        for packet in self._stream.encode():
            self._container.mux(packet)
        self._container.close()
        self._partial.replace(self._path)

    def add(self, image: NDArray[np.uint8]) -> None:
        """Append an (H, W, 3) RGB image."""
        if image.shape != (self._size_px[1], self._size_px[0], 3):
            raise AwarenavError(f"images must be {self._size_px} px, got shape {image.shape}")
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="rgb24")
        for packet in self._stream.encode(frame):
            self._container.mux(packet)
