"""The part of the surroundings that stands still: a given map, also from a map_server file."""

from __future__ import annotations

import logging
import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray, finite_array, finite_number, set_fields
from ..documents import read_yaml
from ..errors import PerceptionError, did_you_mean
from ._points import ScanPoints

_REQUIRED: Final = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
_MODES: Final = ("trinary", "scale", "raw")
# Cells of an OccupancyGrid that count as occupied, in per cent.
_OCCUPIED: Final = (65, 100)
# Side of a cell, as for maps that come as messages.
_SIDE_M: Final = (0.005, 1.0)
_MAX_IMAGE_BYTES: Final = 256 << 20
# The head of a PGM or PPM file: kind, width, height, the value of white; "#" begins a comment.
_NETPBM_HEAD: Final = re.compile(rb"P[2356]" + 3 * rb"(?:\s|#[^\n]*\n)+(\d+)" + rb"\s")
# A PNG names its transparent grey before its pixels.
_PNG_HEAD_BYTES: Final = 4096
# A scan is compared with a map by about so many of its rays, up to this distance.
_RAYS: Final = 60
_COMPARED_M: Final = 10.0
# So many of them must meet something of the map; else it says nothing about the robot's place.
_FEWEST: Final = 10
# It contradicts the map if of the rays that the map accounts for, and those that pass through what
# it holds, more than this share pass through; or if it accounts for no more than this share of
# those that it would stop, all others end before, as in a crowd.
_THROUGH_SHARE: Final = 0.2
_LEAST_SHARE: Final = 0.1
_LOG: Final = logging.getLogger("perception")


def _read_map_file(path: Path) -> tuple[FloatArray, float]:
    """Return the middles (K, 2) of a file's occupied cells in the map's frame, and a cell's side.

    The file is read as ``nav2_map_server`` reads it.

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
    row, column = cells[::-1].nonzero()
    middles = (np.column_stack((column, row)) + 0.5) * side_m
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.asarray(middles @ np.array([[cos, sin], [-sin, cos]]) + (x, y)), side_m


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
    _check_kind(path, data)
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    except cv2.error:
        image = None
    if image is None or image.dtype not in (np.uint8, np.uint16):
        raise PerceptionError(
            f"the map's image {path} is damaged, or no PGM, PPM, PBM, PNG or BMP of 8 or 16 bits"
        )
    white = 255.0 if image.dtype == np.uint8 else 65535.0
    channels = image.reshape(*image.shape[:2], -1)
    colours = channels[..., :3]
    shade = np.asarray(colours.sum(axis=2, dtype=np.float64) / (white * colours.shape[2]))
    return shade, np.asarray(channels[..., 3] == white) if channels.shape[2] == 4 else None


def _check_kind(path: Path, data: bytes) -> None:
    """Refuse images of which OpenCV would return other values than the file has."""
    netpbm = _NETPBM_HEAD.match(data)
    if netpbm is not None and int(netpbm[3]) not in (255, 65535):
        kind = f"PGM or PPM in which white is {int(netpbm[3])}, not 255 or 65535"
    elif data.startswith(b"P7"):
        kind = "PAM (P7)"
    elif data.startswith((b"II*\0", b"MM\0*")):
        kind = "TIFF"
    elif data.startswith(b"\x89PNG") and data[25:26] == b"\0" and b"tRNS" in data[:_PNG_HEAD_BYTES]:
        kind = "grey PNG with a transparent grey"
    else:
        return
    raise PerceptionError(f"the map's image {path} is a {kind}; save it as PGM or PNG")


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


@dataclass(frozen=True, slots=True, eq=False)
class StaticMap:
    """A map of what stands still, in odom, for example a nav_msgs/OccupancyGrid.

    Attributes:
        occupied: (H, W) whether a cell is occupied; row 0 has the lowest y.
        origin_odom_m: (2,) corner of cell (0, 0) with the lowest x and y.
        resolution_m: side of a cell.
        margin_m: points this near to an occupied cell belong to it; allow for the error of the
            robot's place in the map.
        bare: ``occupied`` as given; after that it has the margin.

    Raises:
        PerceptionError: for a map that is not two-dimensional, or a size that is not positive.
    """

    occupied: NDArray[np.bool_]
    origin_odom_m: FloatArray
    resolution_m: float
    margin_m: float = 0.1
    bare: NDArray[np.bool_] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        occupied: Any = np.array(self.occupied, dtype=bool, copy=True)
        if occupied.ndim != 2 or not occupied.size:
            raise PerceptionError(f"occupied must have shape (H, W), got {occupied.shape}")
        side = finite_number("resolution_m", self.resolution_m, minimum=0.0, exclusive_minimum=True)
        margin = finite_number("margin_m", self.margin_m, minimum=0.0)
        occupied.setflags(write=False)
        grown = _grown(occupied, math.ceil(margin / side - 1e-9))
        grown.setflags(write=False)
        set_fields(
            self,
            occupied=grown,
            bare=occupied,
            origin_odom_m=finite_array("origin_odom_m", self.origin_odom_m, (2,)),
            resolution_m=side,
            margin_m=margin,
        )

    def holds(self, points_m: FloatArray) -> NDArray[np.bool_]:
        """Return (N,) whether points (N, 2) in odom belong to it; False outside the map."""
        return self._at(self.occupied, points_m)

    def is_contradicted(self, points: ScanPoints) -> bool | None:
        """Return whether a scan shows that the robot is not where the map has it.

        Its rays then pass through what the map holds, by more than the margin, or end where the map
        has nothing. What stands before the map's walls contradicts nothing. None if too little of
        the map is in view.
        """
        rows = points.usable.nonzero()[0]
        rays = rows[:: max(1, len(rows) // _RAYS)]
        origins, ends = points.origins_odom_m[rays, :2], points.points_odom_m[rays, :2]
        lengths_m = np.maximum(points.ranges_m[rays], 1e-6)
        steps_m = np.arange(self.resolution_m, _COMPARED_M, self.resolution_m)
        along = ((ends - origins) / lengths_m[:, None])[:, None] * steps_m[:, None]
        held = self._at(self.bare, origins[:, None] + along)
        meets = held.any(axis=1)
        if np.count_nonzero(meets) < _FEWEST:
            return None
        first = held.argmax(axis=1)
        explained = self.holds(ends)
        through = meets & (steps_m[first] < lengths_m - 2.0 * self.margin_m - self.resolution_m)
        passed = through.nonzero()[0]
        # What is passed by a hair is seen by the rays beside.
        crossed = (origins + along[np.arange(len(rays)), first])[passed]
        apart = np.linalg.norm(crossed[:, None] - points.points_odom_m[rows, :2], axis=2)
        seen = apart.min(axis=1, initial=np.inf) <= self.margin_m + 1.5 * self.resolution_m
        through[passed[seen]] = False
        explained &= ~through
        known, wrong = np.count_nonzero(explained), np.count_nonzero(through)
        return bool(
            wrong > _THROUGH_SHARE * (known + wrong)
            or known < _LEAST_SHARE * np.count_nonzero(meets)
        )

    def _at(self, cells: NDArray[np.bool_], points_m: FloatArray) -> NDArray[np.bool_]:
        height, width = cells.shape
        column, row = (
            np.floor((points_m[..., axis] - self.origin_odom_m[axis]) / self.resolution_m)
            for axis in (0, 1)
        )
        inside = (column >= 0.0) & (row >= 0.0) & (column < width) & (row < height)
        number = np.where(inside, row * width + column, 0.0).astype(np.int64)
        return np.asarray(inside & cells.ravel()[number])


@dataclass(frozen=True, slots=True, eq=False)
class MapCells:
    """The occupied cells of a map, in the map's frame.

    Attributes:
        cells_m: (K, 2) middles of the cells.
        resolution_m: side of a cell.
        frame_id: name of the frame.
    """

    cells_m: FloatArray
    resolution_m: float
    frame_id: str = "map"

    @classmethod
    def from_yaml(cls, path: str | Path, frame_id: str = "map") -> MapCells:
        """Return the occupied cells of a map in the format of ROS's map_server.

        The YAML file has ``image`` (PGM, PPM, PBM, PNG or BMP; a path from the file's folder),
        ``resolution`` in metres, ``origin`` (x, y and yaw of the lower left corner), ``negate``,
        ``occupied_thresh``, ``free_thresh`` and perhaps ``mode``: ``trinary``, ``scale`` or
        ``raw``. Cells count as occupied from 65 per cent on, as those of an OccupancyGrid.
        Transparent cells are unknown. Other keys are not read, and a warning names them.

        Args:
            path: the YAML file.
            frame_id: name of the map's frame; map_server calls it ``"map"``.

        Raises:
            PerceptionError: for a file that cannot be read, missing or misspelt keys, values out of
                range, or a damaged image.
        """
        return cls(*_read_map_file(Path(path)), frame_id)

    def near(self, T_odom_map: FloatArray, centre_odom_m: FloatArray, reach_m: float) -> StaticMap:
        """Return the part of the map around a place, in odom.

        Args:
            T_odom_map: (4, 4) pose of the map.
            centre_odom_m: (2,) the place.
            reach_m: half the side of the part.
        """
        side_m = self.resolution_m
        origin = np.asarray(centre_odom_m) - reach_m
        places = self.cells_m @ T_odom_map[:2, :2].T + T_odom_map[:2, 3]
        cells = np.floor((places - origin) / side_m)
        extent = max(1, math.ceil(2.0 * reach_m / side_m))
        column, row = cells[((cells >= 0.0) & (cells < extent)).all(axis=1)].astype(np.int64).T
        occupied = np.zeros((extent, extent), dtype=bool)
        occupied[row, column] = True
        return StaticMap(occupied, origin, side_m)


def _grown(occupied: NDArray[np.bool_], cells: int) -> NDArray[np.bool_]:
    """Return the map with every occupied cell grown by this many cells to all sides."""
    out = occupied
    for axis in (0, 1):
        grown = out.copy()
        for step in range(1, cells + 1):
            low, high = [slice(None)] * 2, [slice(None)] * 2
            low[axis], high[axis] = slice(None, -step), slice(step, None)
            grown[tuple(high)] |= out[tuple(low)]
            grown[tuple(low)] |= out[tuple(high)]
        out = grown
    return out
