"""Picture files as (H, W, 3) uint8 RGB, whatever they hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from .._errors import SimError

ImageRgb = NDArray[np.uint8]

#: Names end so.
PICTURE_SUFFIXES: Final = (
    ".png",
    ".jpg",
    ".jpeg",
    ".bmp",
    ".webp",
    ".tif",
    ".tiff",
    ".ppm",
    ".pgm",
)
_FULL_RANGE: Final = {np.dtype(np.uint8): 255, np.dtype(np.uint16): 65535}


def read_picture(path: Path) -> ImageRgb:
    """Read a picture file; grey, 16-bit and transparent ones are converted as :func:`as_rgb` does.

    Raises:
        SimError: when the file cannot be read or holds no picture.
    """
    try:
        data = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as cause:
        raise SimError(f"cannot read {path}: {cause.strerror or cause}") from cause
    if not data.size:
        raise SimError(f"{path} is empty")
    return decode_picture(data, str(path))


def decode_picture(data: NDArray[np.uint8], name: str) -> ImageRgb:
    """Decode the bytes of a picture file (``cv2.imdecode``); raises SimError naming it."""
    try:
        picture = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    except cv2.error as cause:
        raise SimError(f"{name} is no picture that can be read ({cause.err})") from cause
    if picture is None:
        raise SimError(f"{name} is no picture that can be read: damaged, or of another format")
    return as_rgb(picture, name)


def as_rgb(picture: Any, name: str) -> ImageRgb:
    """Turn what OpenCV reads into RGB.

    Grey becomes three equal channels, 16 bits become 8 by their full range, and transparency is
    dropped: the colours under it are what the camera saw.

    Args:
        picture: (H, W), (H, W, 1), (H, W, 3) BGR or (H, W, 4) BGRA; uint8 or uint16.
        name: for the message.

    Raises:
        SimError: for any other array.
    """
    array = np.asarray(picture)
    full = _FULL_RANGE.get(array.dtype)
    channels = 1 if array.ndim == 2 else array.shape[2] if array.ndim == 3 else 0
    if full is None or channels not in (1, 3, 4) or not array.size:
        raise SimError(
            f"{name} must be a grey, colour or transparent picture of 8 or 16 bits, got "
            f"{array.dtype} of shape {array.shape}"
        )
    if full != 255:
        array = cv2.convertScaleAbs(array, alpha=255.0 / full)
    code = {1: cv2.COLOR_GRAY2RGB, 3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGB}[channels]
    return np.asarray(cv2.cvtColor(array, code), dtype=np.uint8)
