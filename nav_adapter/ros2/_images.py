"""Image messages as (H, W, 3) uint8 RGB, and camera_info as a camera."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception import Camera, PerceptionError
from perception.no_view import eight_bits

from .._errors import NavError

# sensor_msgs/image_encodings.hpp: samples per pixel, and OpenCV's conversion to RGB.
_ENCODINGS: Final[dict[str, tuple[int, int | None]]] = {
    "rgb8": (3, None),
    "bgr8": (3, cv2.COLOR_BGR2RGB),
    "8UC3": (3, cv2.COLOR_BGR2RGB),
    "rgba8": (4, cv2.COLOR_RGBA2RGB),
    "bgra8": (4, cv2.COLOR_BGRA2RGB),
    "8UC4": (4, cv2.COLOR_BGRA2RGB),
    "mono8": (1, cv2.COLOR_GRAY2RGB),
    "8UC1": (1, cv2.COLOR_GRAY2RGB),
    "rgb16": (3, None),
    "bgr16": (3, cv2.COLOR_BGR2RGB),
    "mono16": (1, cv2.COLOR_GRAY2RGB),
    # OpenCV names a Bayer pattern by its second row, ROS by its first.
    "bayer_rggb8": (1, cv2.COLOR_BayerBG2RGB),
    "bayer_bggr8": (1, cv2.COLOR_BayerRG2RGB),
    "bayer_gbrg8": (1, cv2.COLOR_BayerGR2RGB),
    "bayer_grbg8": (1, cv2.COLOR_BayerGB2RGB),
    "yuv422": (2, cv2.COLOR_YUV2RGB_UYVY),
    "uyvy": (2, cv2.COLOR_YUV2RGB_UYVY),
    "yuv422_yuy2": (2, cv2.COLOR_YUV2RGB_YUY2),
    "yuyv": (2, cv2.COLOR_YUV2RGB_YUY2),
}
# REP 118: millimetres with 0 as hole, and metres with NaN as hole.
_DEPTH_TYPES: Final = {"16UC1": "u2", "32FC1": "f4"}
_SIXTEEN_BITS: Final = ("rgb16", "bgr16", "mono16")


def picture_of(message: Any) -> NDArray[np.uint8]:
    """Return the image of a message, (H, W, 3) uint8 RGB.

    16-bit values are scaled to 8 bits over their full range. Transparency is dropped. The
    orientation in a file's metadata is ignored, since the calibration is for the pixels as stored.

    Args:
        message: ``sensor_msgs`` Image or CompressedImage, of this package or of another library.

    Raises:
        NavError: for an unsupported encoding, too few bytes, a damaged file, or 16-bit values that
            use too little of their range.
    """
    if not hasattr(message, "encoding"):
        return _decompressed(message)
    if message.encoding not in _ENCODINGS:
        counts = message.encoding in _DEPTH_TYPES
        raise NavError(
            f"encoding must be one of {', '.join(_ENCODINGS)}, got {message.encoding!r}"
            + (", that of depth images and of raw counts: scale these to mono8" if counts else "")
        )
    depth, code = _ENCODINGS[message.encoding]
    height, width = int(message.height), int(message.width)
    wide = message.encoding in _SIXTEEN_BITS
    rows = _rows(message, depth * (2 if wide else 1))
    if wide:
        samples = np.ascontiguousarray(rows).view(">u2" if message.is_bigendian else "<u2")
        native = samples.astype(np.uint16, copy=False)
        try:
            rows = eight_bits(native)
        except PerceptionError as cause:
            raise NavError(f"{message.encoding}: {cause}") from cause
    pixels = rows.reshape(height, width, depth) if depth > 1 else rows
    try:
        rgb = pixels if code is None else cv2.cvtColor(np.ascontiguousarray(pixels), code)
    except cv2.error as cause:
        raise NavError(f"{message.encoding} of {width} x {height} px: {cause.err}") from cause
    return np.ascontiguousarray(rgb, dtype=np.uint8)


def depth_of(message: Any) -> NDArray[Any]:
    """Return the depth image of a message (REP 118), (H, W): uint16 millimetres or float32 metres.

    Args:
        message: ``sensor_msgs`` Image of the encoding ``16UC1`` or ``32FC1``.

    Raises:
        NavError: for another encoding, or too few bytes.
    """
    encoding = getattr(message, "encoding", "a compressed image")
    if encoding not in _DEPTH_TYPES:
        raise NavError(
            f"the encoding of a depth image must be {' or '.join(_DEPTH_TYPES)}, got {encoding!r}"
        )
    stored = np.dtype((">" if message.is_bigendian else "<") + _DEPTH_TYPES[encoding])
    rows = np.ascontiguousarray(_rows(message, stored.itemsize)).view(stored)
    return rows.astype(stored.newbyteorder("="))


def camera_of(
    message: Any, *, rectified: bool = False, image_size_px: tuple[int, int] | None = None
) -> Camera:
    """Return the camera of the images that a ``camera_info`` message comes with.

    Args:
        message: ``sensor_msgs`` CameraInfo, of this package or of another library.
        rectified: as in :meth:`perception.Camera.from_camera_info`.
        image_size_px: likewise.

    Raises:
        NavError: for the zeros of an uncalibrated driver, an unsupported distortion model, or
            fields that contradict each other or the images.
    """
    try:
        return Camera.from_camera_info(message, rectified=rectified, image_size_px=image_size_px)
    except PerceptionError as cause:
        raise NavError(f"camera_info: {cause}") from cause


def _rows(message: Any, pixel_bytes: int) -> NDArray[np.uint8]:
    """Return the rows of a message without their padding, (H, W · bytes of a pixel)."""
    height, width, step = int(message.height), int(message.width), int(message.step)
    row = width * pixel_bytes
    if step < row:
        raise NavError(
            f"rows of {width} px of {message.encoding} need a step of at least {row} bytes, got "
            f"{step}: the driver fills in a wrong step, width or encoding"
        )
    if height * width == 0 or len(message.data) < height * step:
        raise NavError(
            f"{width} x {height} px of {message.encoding} with {step} bytes per row need "
            f"{height * step} bytes and at least one pixel, got {len(message.data)} bytes"
        )
    return np.frombuffer(message.data, np.uint8, height * step).reshape(height, step)[:, :row]


def _decompressed(message: Any) -> NDArray[np.uint8]:
    data = np.frombuffer(message.data, np.uint8)
    try:
        as_it_is = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
        bgr = cv2.imdecode(data, as_it_is) if data.size else None
    except cv2.error:
        bgr = None
    if bgr is None:
        raise NavError(
            f"a compressed image must hold an image file, got {data.size} bytes of format "
            f"{message.format!r} that cannot be read"
        )
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), dtype=np.uint8)
