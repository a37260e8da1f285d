"""Map files of ROS's map_server: a YAML file, and the image that it names."""

from __future__ import annotations

import logging
import re
import warnings
from pathlib import Path
from typing import Any, Final, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray, finite_array, finite_number
from ..documents import read_yaml
from ..errors import PerceptionError, did_you_mean

_REQUIRED: Final = (
    "image",
    "resolution",
    "origin",
    "negate",
    "occupied_thresh",
    "free_thresh",
)
_MODES: Final = ("trinary", "scale", "raw")
# Cells of an OccupancyGrid that count as occupied, in per cent.
_OCCUPIED: Final = (65, 100)
# Side of a cell, as for maps that come as messages.
_SIDE_M: Final = (0.005, 1.0)
_MAX_IMAGE_BYTES: Final = 256 << 20
_MAX_CELLS: Final = 100_000_000
# The head of a PGM or PPM file: kind, width, height, the value of white; "#" begins a comment.
_NETPBM_HEAD: Final = re.compile(rb"P([2356])" + 3 * rb"(?:\s|#[^\n]*\n)+(\d{1,9})" + rb"\s")
_COMMENT: Final = re.compile(rb"#[^\n]*")
_LOG: Final = logging.getLogger("perception")


class MapImage(NamedTuple):
    """A map as its file has it.

    Attributes:
        occupied: (H, W) whether a cell is occupied; row 0 has the lowest y of the map.
        origin: x and y of the lower left corner in metres, and the map's yaw in radians.
        resolution_m: side of a cell.
    """

    occupied: NDArray[np.bool_]
    origin: tuple[float, float, float]
    resolution_m: float


def read_map_file(path: Path) -> MapImage:
    """Return the map of a file, as ``nav2_map_server`` reads it.

    Raises:
        PerceptionError: the message names the file, says what it has and what is valid.
    """
    data = read_yaml(path)
    if not isinstance(data, dict):
        raise PerceptionError(f"{path} must hold the keys {', '.join(_REQUIRED)}")
    valid = (*_REQUIRED, "mode")
    unknown = [key for key in data if key not in valid]
    for key in unknown:
        if near := did_you_mean(str(key).lower(), valid, cutoff=0.8):
            raise PerceptionError(
                f"{path} has the unknown key {key!r}, valid are {', '.join(valid)}{near}"
            )
    if unknown:  # such as those of tools that draw maps; map_server leaves them out as well
        _LOG.warning("%s: not read: %s", path, ", ".join(map(repr, unknown)))
    missing = [key for key in _REQUIRED if key not in data]
    if missing:
        raise PerceptionError(f"{path} lacks the key {missing[0]!r} of a map_server file")
    try:
        side_m = _between("resolution", data["resolution"], *_SIDE_M)
        x, y, yaw = finite_array("origin", data["origin"], (3,)).tolist()
        occupied = _between("occupied_thresh", data["occupied_thresh"], 0.0, 1.0)
        free = _between("free_thresh", data["free_thresh"], 0.0, 1.0)
        if free >= occupied:
            raise PerceptionError(
                f"free_thresh must be below occupied_thresh, got {free:g} and {occupied:g}"
            )
        negate = data["negate"]
        if negate not in (0, 1):  # False and True as well
            raise PerceptionError(f"negate must be 0 or 1, got {negate!r}")
        mode = data.get("mode", _MODES[0])
        if mode not in _MODES:
            raise PerceptionError(f"mode must be one of {', '.join(_MODES)}, got {mode!r}")
        image = data["image"]
        if not isinstance(image, str) or not image:
            raise PerceptionError(f"image must be the path of an image, got {image!r}")
    except PerceptionError as cause:
        raise PerceptionError(f"{path}: {cause}") from cause
    shade, opaque = _shades(path.parent / image)
    percent = _percent(shade, mode, bool(negate), occupied, free)
    if opaque is not None:
        percent[~opaque] = -1.0  # as nav2_map_server since 2025, in every mode
    cells = (percent >= _OCCUPIED[0]) & (percent <= _OCCUPIED[1])
    # The first row of an image is the highest of the map.
    return MapImage(cells[::-1], (x, y, yaw), side_m)


def _between(name: str, value: Any, low: float, high: float) -> float:
    if isinstance(value, str):  # float() takes it
        raise PerceptionError(f"{name} must be a number, got {value!r}")
    return finite_number(name, value, minimum=low, maximum=high)


def _shades(path: Path) -> tuple[FloatArray, NDArray[np.bool_] | None]:
    """Return the brightness (H, W) of an image in [0, 1], and which pixels are opaque.

    Without an alpha channel the second value is None.
    """
    try:
        with path.open("rb") as file:
            data = file.read(_MAX_IMAGE_BYTES + 1)
    except (OSError, ValueError) as cause:  # ValueError: a path with a zero byte
        reason = getattr(cause, "strerror", None) or cause
        raise PerceptionError(f"cannot read the map's image {path}: {reason}") from cause
    if len(data) > _MAX_IMAGE_BYTES:
        limit = _MAX_IMAGE_BYTES >> 20
        raise PerceptionError(f"the map's image {path} is too large: at most {limit} MiB are read")
    head = _NETPBM_HEAD.match(data)
    if head is not None:
        return _netpbm_shades(path, data, head), None
    if data.startswith((b"P7", b"II*\0", b"MM\0*")):
        # OpenCV takes the numbers of one for shares of 255 or 65535, and drops the other's alpha.
        kind = "PAM (P7)" if data.startswith(b"P7") else "TIFF"
        raise PerceptionError(f"the map's image {path} is a {kind}; save it as PGM or PNG")
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    except cv2.error:
        image = None
    if image is None or image.dtype not in (np.uint8, np.uint16):
        raise _damaged(path)
    _check_size(path, image.shape[1], image.shape[0])
    white = 255.0 if image.dtype == np.uint8 else 65535.0
    channels = image.reshape(*image.shape[:2], -1)
    colours = channels[..., :3]
    shade = np.asarray(colours.sum(axis=2, dtype=np.float64) / (white * colours.shape[2]))
    if channels.shape[2] == 4:
        return shade, np.asarray(channels[..., 3] == white)
    clear = _transparent_grey(data)
    return shade, None if clear is None else np.abs(shade - clear) > 0.5 / white


def _transparent_grey(data: bytes) -> float | None:
    """Return the brightness of the transparent pixels of a grey PNG, which OpenCV drops."""
    if not data.startswith(b"\x89PNG") or data[25:26] != b"\x00":
        return None
    at = 8
    while (kind := data[at + 4 : at + 8]) not in (b"tRNS", b"IDAT", b""):
        at += 12 + int.from_bytes(data[at : at + 4], "big")
    if kind != b"tRNS":
        return None
    return int.from_bytes(data[at + 8 : at + 10], "big") / ((1 << data[24]) - 1)


def _netpbm_shades(path: Path, data: bytes, head: re.Match[bytes]) -> FloatArray:
    """Return the brightness (H, W) of a PGM or PPM file in [0, 1].

    White is what the file says, not what the bits could hold: OpenCV reads 1023 of 1023 as 1 of 64.
    """
    kind, width, height, white = map(int, head.groups())
    _check_size(path, width, height)
    count = width * height * (3 if kind in (3, 6) else 1)
    deep = white >= 256
    body = data[head.end() :]
    least_bytes = 2 * count - 1 if kind in (2, 3) else count * (2 if deep else 1)
    if not count or not 0 < white < 65536 or len(body) < least_bytes:
        raise _damaged(path)
    if kind in (2, 3):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # older NumPy warns of what is no number
                values = np.fromstring(_COMMENT.sub(b"", body), np.int64, sep=" ")[:count]
        except (ValueError, DeprecationWarning) as cause:
            raise _damaged(path) from cause
    else:
        values = np.frombuffer(body, ">u2" if deep else np.uint8, count)
    if len(values) < count or values.min() < 0 or values.max() > white:
        raise _damaged(path)
    shade = values.reshape(height, width, -1).mean(axis=2, dtype=np.float64) / white
    return np.asarray(shade)


def _check_size(path: Path, width: int, height: int) -> None:
    if width * height > _MAX_CELLS:
        raise PerceptionError(
            f"the map's image {path} must have at most {_MAX_CELLS} pixels, got {width} x {height}"
        )


def _damaged(path: Path) -> PerceptionError:
    return PerceptionError(
        f"the map's image {path} is damaged, or no PGM, PPM, PBM, PNG or BMP of 8 or 16 bits"
    )


def _percent(
    shade: FloatArray,
    mode: str,
    negate: bool,
    occupied: float,
    free: float,
) -> FloatArray:
    """Return the occupancy (H, W) in per cent as an OccupancyGrid has it, −1 for unknown cells."""
    if mode == "raw":
        value = np.round(255.0 * shade)
        return np.where(value <= 100.0, value, -1.0)
    share = shade if negate else 1.0 - shade
    percent = np.full(share.shape, -1.0)
    if mode == "scale":
        percent = np.rint((share - free) / (occupied - free) * 100.0)
    percent[share < free] = 0.0
    percent[share > occupied] = 100.0
    return percent
