"""Picture files as (H, W, 3) uint8 RGB, whatever they hold.

Where frames come from: the seam between image sources and the estimator.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from perception import Camera
from perception.arrays import FloatArray, ImageRgb

from ..errors import AwarenavError

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
        AwarenavError: when the file cannot be read or holds no picture.
    """
    try:
        data = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as cause:
        raise AwarenavError(f"cannot read {path}: {cause.strerror or cause}") from cause
    if not data.size:
        raise AwarenavError(f"{path} is empty")
    return decode_picture(data, str(path))


def decode_picture(data: NDArray[np.uint8], name: str) -> ImageRgb:
    """Decode the bytes of a picture file (``cv2.imdecode``); raises AwarenavError naming it."""
    try:
        picture = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    except cv2.error as cause:
        raise AwarenavError(f"{name} is no picture that can be read ({cause.err})") from cause
    if picture is None:
        raise AwarenavError(f"{name} is no picture that can be read: damaged, or of another format")
    return as_rgb(picture, name)


def as_rgb(picture: Any, name: str) -> ImageRgb:
    """Turn what OpenCV reads into RGB.

    Grey becomes three equal channels, 16 bits become 8 by their full range, and transparency is
    dropped: the colours under it are what the camera saw.

    Args:
        picture: (H, W), (H, W, 1), (H, W, 3) BGR or (H, W, 4) BGRA; uint8 or uint16.
        name: for the message.

    Raises:
        AwarenavError: for any other array.
    """
    array = np.asarray(picture)
    full = _FULL_RANGE.get(array.dtype)
    channels = 1 if array.ndim == 2 else array.shape[2] if array.ndim == 3 else 0
    if full is None or channels not in (1, 3, 4) or not array.size:
        raise AwarenavError(
            f"{name} must be a grey, colour or transparent picture of 8 or 16 bits, got "
            f"{array.dtype} of shape {array.shape}"
        )
    if full != 255:
        array = cv2.convertScaleAbs(array, alpha=255.0 / full)
    code = {1: cv2.COLOR_GRAY2RGB, 3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGB}[channels]
    return np.asarray(cv2.cvtColor(array, code), dtype=np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class SourceFrame:
    """One picture of a source.

    Attributes:
        name: of the frame in the results: a file's name, or a number.
        stamp_s: when it was taken.
        image_rgb: (H, W, 3) uint8; None when it could not be read.
        T_odom_camera: (4, 4) where the camera was, or None when the source does not know.
        problem: why there is no picture.
    """

    name: str
    stamp_s: float
    image_rgb: ImageRgb | None
    T_odom_camera: FloatArray | None = None
    problem: str = ""


class ImageSource(Protocol):
    """Frames one after another, with what the source knows about the camera.

    Attributes:
        camera: its calibration, if the source brings one.
        count: how many frames there are, if that is known; a video's own claim may be wrong.
        rate_hz: frames a second, if the source has such a thing.
        live: frames come as time passes; one that is not taken is lost.
    """

    camera: Camera | None
    count: int | None
    rate_hz: float | None
    live: bool

    def frames(self) -> Iterator[SourceFrame]:
        """Yield the frames; one that cannot be read has a ``problem`` instead of a picture.

        A source that ends before its time yields such a frame last.
        """
        ...

    def close(self) -> None:
        """Give back the device or file."""
        ...
