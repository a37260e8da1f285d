"""Image files as (H, W, 3) uint8 RGB arrays, whatever their format."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from perception.arrays import ImageRgb

from ..errors import AwarenavError
from ._exif import decode_upright

#: Suffixes of the names of image files.
IMAGE_SUFFIXES: Final = (
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


def read_image(path: Path) -> ImageRgb:
    """Read an image file, upright as its EXIF orientation says.

    Grey, 16-bit and transparent images are converted as by :func:`as_rgb`.

    Raises:
        AwarenavError: for a file that cannot be read or is not an image.
    """
    return read_turned_image(path)[0]


def read_turned_image(path: Path) -> tuple[ImageRgb, int]:
    """Read an image file as :func:`read_image` does; return its EXIF orientation too.

    The orientation is 1 for a file that is stored upright.
    """
    try:
        data = path.read_bytes()
    except OSError as cause:
        raise AwarenavError(f"cannot read {path}: {cause.strerror or cause}") from cause
    if not data:
        raise AwarenavError(f"{path} is empty")
    try:
        image, orientation = decode_upright(data)
    except cv2.error as cause:
        raise AwarenavError(f"{path} is not an image that can be read ({cause.err})") from cause
    if image is None:
        raise AwarenavError(f"{path} is not an image that can be read: damaged, or another format")
    return as_rgb(image, str(path)), orientation


def as_rgb(image: Any, name: str) -> ImageRgb:
    """Convert an image that OpenCV has read to RGB.

    Grey becomes three equal channels. 16 bits become 8 by their full range. The transparency is
    dropped.

    Args:
        image: (H, W), (H, W, 1), (H, W, 3) BGR or (H, W, 4) BGRA; uint8 or uint16.
        name: of the image, for the message.

    Raises:
        AwarenavError: for any other array.
    """
    array = np.asarray(image)
    full = _FULL_RANGE.get(array.dtype)
    channels = 1 if array.ndim == 2 else array.shape[2] if array.ndim == 3 else 0
    if full is None or channels not in (1, 3, 4) or not array.size:
        raise AwarenavError(
            f"{name} must be a grey, colour or transparent image of 8 or 16 bits, got "
            f"{array.dtype} of shape {array.shape}"
        )
    if full != 255:
        array = cv2.convertScaleAbs(array, alpha=255.0 / full)
    code = {1: cv2.COLOR_GRAY2RGB, 3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGB}[channels]
    return np.asarray(cv2.cvtColor(array, code), dtype=np.uint8)
