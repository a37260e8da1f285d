"""Animated WebP images, which browsers and code hosts show without a player."""

from __future__ import annotations

from contextlib import AbstractContextManager
from fractions import Fraction
from pathlib import Path
from typing import Final

import av
import numpy as np

from awarenav.errors import AwarenavError
from perception.arrays import ImageRgb

# Of libwebp: 0 to 100, and 0 (fast) to 6 (small).
_QUALITY: Final = 80
_COMPRESSION_LEVEL: Final = 4


class AnimatedImageWriter(AbstractContextManager["AnimatedImageWriter"]):
    """An animated WebP image that repeats for ever; it appears when it is closed.

    Args:
        path: of the file, which ends in ``.webp``.
        rate_hz: pictures per second.
        size_px: width and height.
        hold_s: time for which the last picture is shown.
    """

    def __init__(
        self, path: Path, rate_hz: int, size_px: tuple[int, int], hold_s: float = 0.0
    ) -> None:
        self._path = path
        self._partial = path.with_name(path.name + ".part")
        self._size_px = size_px
        self._rate_hz = rate_hz
        self._hold = max(round(hold_s * rate_hz) - 1, 0)
        self._pictures = 0
        self._last: ImageRgb | None = None
        # Loop 0 repeats for ever.
        self._container = av.open(
            str(self._partial), mode="w", format="webp", options={"loop": "0"}
        )
        self._stream = self._container.add_stream("libwebp_anim", rate=Fraction(rate_hz))
        self._stream.width, self._stream.height = size_px
        self._stream.pix_fmt = "bgra"
        self._stream.options = {
            "quality": str(_QUALITY),
            "compression_level": str(_COMPRESSION_LEVEL),
        }

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Finish the file."""
        if self._last is not None and self._hold:
            # The encoder joins equal pictures into one that is shown longer.
            self._encode(self._last, self._pictures - 1 + self._hold)
        for packet in self._stream.encode():
            self._container.mux(packet)
        self._container.close()
        self._partial.replace(self._path)

    def add(self, image: ImageRgb) -> None:
        """Append an (H, W, 3) RGB image.

        Raises:
            AwarenavError: for an image of another size.
        """
        if image.shape != (self._size_px[1], self._size_px[0], 3):
            raise AwarenavError(f"images must be {self._size_px} px, got shape {image.shape}")
        self._encode(image, self._pictures)
        self._pictures += 1
        self._last = image

    def _encode(self, image: ImageRgb, number: int) -> None:
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="rgb24")
        frame = frame.reformat(format="bgra")
        frame.pts, frame.time_base = number, Fraction(1, self._rate_hz)
        for packet in self._stream.encode(frame):
            self._container.mux(packet)
