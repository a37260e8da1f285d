"""H.264 videos and animated WebP images, written with PyAV, of the extra ``sim``."""

from __future__ import annotations

from contextlib import AbstractContextManager
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import av
import numpy as np
from numpy.typing import NDArray

from .errors import AwarenavError

# Of each suffix: encoder, pixel format, options of the file and of the encoder. An animated image
# repeats for ever (loop 0); its quality is 0 to 100, its compression 0 (fast) to 6 (small).
_KINDS: Final[dict[str, tuple[Any, str, dict[str, str], dict[str, str]]]] = {
    ".mp4": ("libx264", "yuv420p", {}, {"crf": "21", "preset": "veryfast"}),
    ".webp": (
        "libwebp_anim",
        "bgra",
        {"loop": "0"},
        {"quality": "58", "compression_level": "5"},
    ),
}


class VideoWriter(AbstractContextManager["VideoWriter"]):
    """An MP4 file (H.264) or an animated WebP image; the file appears when it is closed.

    Common players play the MP4; browsers and code hosts show the image without a player.

    Args:
        path: of the file, which ends in ``.mp4`` or ``.webp``.
        rate_hz: frames per second.
        size_px: width and height, both even.

    Raises:
        AwarenavError: for another kind of file, or an odd size.
    """

    def __init__(self, path: Path, rate_hz: int, size_px: tuple[int, int]) -> None:
        if size_px[0] % 2 or size_px[1] % 2:
            raise AwarenavError(f"size_px must be even for yuv420p, got {size_px}")
        if path.suffix.lower() not in _KINDS:
            raise AwarenavError(f"a film must be a .webp or .mp4 file, got {path}")
        encoder, pixels, file_options, options = _KINDS[path.suffix.lower()]
        self._path = path
        self._partial = path.with_name(path.name + ".part")
        self._size_px = size_px
        self._rate_hz = rate_hz
        self._frames = 0
        self._container = av.open(
            str(self._partial), mode="w", format=path.suffix[1:].lower(), options=file_options
        )
        self._stream = self._container.add_stream(encoder, rate=Fraction(rate_hz))
        self._stream.width, self._stream.height = size_px
        self._stream.pix_fmt = pixels
        self._stream.options = options

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
        frame.pts, frame.time_base = self._frames, Fraction(1, self._rate_hz)
        self._frames += 1
        for packet in self._stream.encode(frame):
            self._container.mux(packet)
