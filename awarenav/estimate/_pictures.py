"""Image files as (H, W, 3) uint8 RGB arrays, upright as their EXIF orientation says."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception import PerceptionError
from perception.arrays import ImageRgb
from perception.no_view import eight_bits

from ..errors import AwarenavError

#: Suffixes of the names of image files.
IMAGE_SUFFIXES: Final = (
    *(".png", ".jpg", ".jpeg", ".bmp", ".webp", ".tif", ".tiff", ".ppm", ".pgm"),
)
_FULL_RANGE: Final = {np.dtype(np.uint8): 255, np.dtype(np.uint16): 65535}
_ORIENTATION: Final = 0x0112
# The focal length that has this diagonal field on film of 35 mm, and the image's size then.
_FOCAL_35MM, _WIDTH, _HEIGHT = 0xA405, 0xA002, 0xA003
_FILM_MM: Final = math.hypot(36.0, 24.0)
# Where the directory with those numbers begins.
_MORE: Final = 0x8769
# An image with sides of another ratio was cut after it was taken.
_SAME_RATIO: Final = 0.01
# Types of a number: the standard wants the first, some writers use the second.
_SHORT, _LONG = 3, 4
_JPEG, _PNG = b"\xff\xd8", b"\x89PNG\r\n\x1a\n"
_TIFF: Final = {b"II*\0": "<", b"MM\0*": ">"}
_EXIF: Final = b"Exif\0\0"
#: Tag of a file that is stored upright.
UPRIGHT: Final = 1
# EXIF 2.32, 4.6.4: how the stored image becomes upright.
_FLIPS: Final = {2: 1, 3: -1, 4: 0, 6: 1, 7: -1, 8: 0}
_LAST: Final = 8
#: From this one on, width and height of the upright image are exchanged.
FIRST_TRANSPOSED: Final = 5


def read_image(path: Path) -> ImageRgb:
    """Read an image file, upright as its EXIF orientation says.

    Grey, 16-bit and transparent images are converted as by :func:`as_rgb`.

    Raises:
        AwarenavError: for a file that cannot be read or is not an image.
    """
    return read_turned_image(path)[0]


def read_turned_image(path: Path) -> tuple[ImageRgb, int, float | None]:
    """Read an image file as :func:`read_image` does; return its EXIF orientation and focal length.

    The orientation is 1 for a file that is stored upright. The focal length is in pixels, None for
    a file that does not say it, or was cut since.
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
    height, width = image.shape[:2]
    return as_rgb(image, str(path)), orientation, _exif_focal_px(data, height, width)


def as_rgb(image: Any, name: str) -> ImageRgb:
    """Convert an image that OpenCV has read to RGB.

    Grey becomes three equal channels. 16 bits become 8 by their full range. The transparency is
    dropped.

    Args:
        image: (H, W), (H, W, 1), (H, W, 3) BGR or (H, W, 4) BGRA; uint8 or uint16.
        name: of the image, for the message.

    Raises:
        AwarenavError: for any other array, and 16-bit values that use too little of their range.
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
        try:
            array = eight_bits(array)
        except PerceptionError as cause:
            raise AwarenavError(f"{name}: {cause}") from cause
    code = {1: cv2.COLOR_GRAY2RGB, 3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGB}[channels]
    return np.asarray(cv2.cvtColor(array, code), dtype=np.uint8)


def exif_orientation(data: bytes) -> int:
    """Return the orientation of a JPEG, PNG, WebP or TIFF file, 1 to 8; 1 (upright) without one."""
    orientation = _exif(data).get(_ORIENTATION, UPRIGHT)
    return orientation if UPRIGHT <= orientation <= _LAST else UPRIGHT


def _exif_focal_px(data: bytes, height_px: int, width_px: int) -> float | None:
    numbers = _exif(data)
    focal_mm = numbers.get(_FOCAL_35MM, 0)
    sides = sorted((numbers.get(_WIDTH, width_px), numbers.get(_HEIGHT, height_px)))
    own = sorted((width_px, height_px))
    cut = min(sides) <= 0 or abs(sides[1] * own[0] / (sides[0] * own[1]) - 1.0) > _SAME_RATIO
    return None if focal_mm <= 0 or cut else focal_mm / _FILM_MM * math.hypot(*own)


def _exif(data: bytes) -> dict[int, int]:
    """Return the whole numbers in the EXIF data of a file, by tag."""
    found: dict[int, int] = {}
    try:
        for block in _exif_blocks(data):
            for tag, value in _in_tiff(block.removeprefix(_EXIF)):
                found.setdefault(tag, value)
    except struct.error:  # cut off
        pass
    return found


def upright(image: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Return a stored image (H, W, …) as its EXIF orientation wants it shown."""
    if orientation >= FIRST_TRANSPOSED:
        image = np.ascontiguousarray(np.swapaxes(image, 0, 1))
    flip = _FLIPS.get(orientation)
    return image if flip is None else np.asarray(cv2.flip(image, flip))


def decode_upright(data: bytes) -> tuple[NDArray[Any] | None, int]:
    """Return the image in a file as OpenCV stores it, upright, and the file's EXIF orientation.

    None for a file that cannot be decoded.

    Raises:
        cv2.error: for some of these.
    """
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    orientation = exif_orientation(data)
    if image is None or data[:4] in _TIFF:  # OpenCV turns a TIFF itself
        return image, orientation
    return upright(np.asarray(image), orientation), orientation


def _exif_blocks(data: bytes) -> Iterator[bytes]:
    """Yield the blocks of EXIF data in a file: each is a TIFF file without an image."""
    if data[:4] in _TIFF:
        yield data
    elif data.startswith(_JPEG):
        at = len(_JPEG)
        while data[at : at + 1] == b"\xff":
            if data[at + 1 : at + 2] == b"\xff":  # any number of these may stand before a marker
                at += 1
                continue
            marker, length = struct.unpack_from(">BH", data, at + 1)
            if marker == 0xDA:  # the image
                return
            if marker == 0xE1 and data[at + 4 :].startswith(_EXIF):
                yield data[at + 4 : at + 2 + length]
            at += 2 + length
    elif data.startswith(_PNG):
        at = len(_PNG)
        while at < len(data):
            length, kind = struct.unpack_from(">I4s", data, at)
            if kind == b"eXIf":
                yield data[at + 8 : at + 8 + length]
            at += 12 + length
    elif data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        at = 12
        while at < len(data):
            kind, length = struct.unpack_from("<4sI", data, at)
            if kind == b"EXIF":
                yield data[at + 8 : at + 8 + length]
            at += 8 + length + length % 2


def _in_tiff(block: bytes) -> Iterator[tuple[int, int]]:
    """Yield tags and whole numbers in the first directory of a TIFF file, and in EXIF's own."""
    order = _TIFF.get(block[:4])
    if order is None:
        return
    (at,) = struct.unpack_from(order + "I", block, 4)
    own, directories = True, [at]
    while directories:
        at = directories.pop()
        (entries,) = struct.unpack_from(order + "H", block, at)
        for entry in range(entries):
            place = at + 2 + 12 * entry
            tag, kind, _ = struct.unpack_from(order + "HHI", block, place)
            if kind not in (_SHORT, _LONG):
                continue
            (value,) = struct.unpack_from(
                order + ("H" if kind == _SHORT else "I"), block, place + 8
            )
            yield tag, int(value)
            if tag == _MORE and own:
                own, directories = False, [int(value)]
