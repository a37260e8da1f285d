"""The fields of a ``sensor_msgs/CameraInfo``, from a file or a message, for any distortion model.

All that reads a calibration reads it here: files, recordings, live topics and folders.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from .arrays import FloatArray, pixel_count
from .documents import read_yaml
from .errors import PerceptionError

# Fields of the message (ROS 2 in lower case, ROS 1 in upper case) and the names that
# camera_calibration gives them.
_KEYS: Final = {
    "width": "image_width",
    "height": "image_height",
    "k": "camera_matrix",
    "K": "camera_matrix",
    "d": "distortion_coefficients",
    "D": "distortion_coefficients",
    "p": "projection_matrix",
    "P": "projection_matrix",
    "r": "rectification_matrix",
    "R": "rectification_matrix",
    **{name: name for name in ("distortion_model", "binning_x", "binning_y", "roi")},
}
_READ: Final = frozenset((*_KEYS.values(), "header", "camera_name", "camera_model"))
# Names under which other tools store a distortion.
_DISTORTION_KEY: Final = re.compile(
    r"dist(?!ance)|fisheye|radial|tangential|coef|^[kp]_?[1-6]$", re.IGNORECASE
)
#: The models whose coefficients are OpenCV's k1, k2, p1, p2, k3, …, under all their names.
PINHOLE: Final = "plumb_bob"
_PINHOLE_NAMES: Final = (
    PINHOLE,
    "rational_polynomial",
    "radtan",
    "radial_tangential",
    "brown_conrady",
)
#: Kannala and Brandt's fisheye model, under all its names.
FISHEYE: Final = "equidistant"
_FISHEYE_NAMES: Final = (FISHEYE, "fisheye", "kannala_brandt", "kannala_brandt4")
# Names that say that there is no distortion.
_NO_DISTORTION: Final = ("", "none", "pinhole", "perspective")
_COUNTS: Final = {PINHOLE: (0, 4, 5, 8, 12, 14), FISHEYE: (0, 4)}
# A shorter focal length, in image widths, is a view of more than 177°.
_SHORTEST_FOCAL: Final = 0.02
_LARGEST_SKEW: Final = 1e-3
# No lens has its axis further from the middle, in shares of width and height, both at once.
_OFF_CENTRE: Final = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class CameraInfo:
    """A calibration; :meth:`seen` has the numbers for the images as they are delivered.

    Attributes:
        width_px: width of the full image, before ``roi`` and ``binning``.
        height_px: likewise.
        matrix: (3, 3) K, of the full raw image.
        coefficients: (N,) coefficients of the distortion model.
        model: :data:`PINHOLE`, :data:`FISHEYE`, or the name of another model.
        projection: (3, 4) P, of the full rectified image; zeros if it is not known.
        roi_px: x, y, width and height of the part that is delivered; zeros for all.
        binning: number of pixels that are joined, across and down.
    """

    width_px: int
    height_px: int
    matrix: FloatArray
    coefficients: FloatArray
    model: str
    projection: FloatArray
    roi_px: tuple[int, int, int, int]
    binning: tuple[int, int]

    @classmethod
    def from_yaml(cls, path: str | Path) -> CameraInfo:
        """Read a file of ``camera_calibration``, or a message that ``ros2 topic echo`` prints.

        Raises:
            PerceptionError: for a file that cannot be read or is not complete; it names the file.
        """
        path = Path(path)
        try:
            # Each echoed message ends with "---"; the first message counts.
            data = read_yaml(path, first_document=True)
            if not isinstance(data, dict):
                raise PerceptionError(f"{path} must hold the keys of a ROS camera_info file")
        except PerceptionError as cause:
            if _is_of_opencv(path):
                raise PerceptionError(
                    f"{path} is a file of OpenCV's FileStorage: copy its numbers into a ROS "
                    "camera_info file (image_width, image_height, camera_matrix, distortion_model "
                    "and distortion_coefficients, without !!opencv-matrix and %YAML:1.0)"
                ) from cause
            raise
        try:
            return cls.of(data)
        except PerceptionError as cause:
            raise PerceptionError(f"{path}: {cause}") from cause

    @classmethod
    def of(cls, info: Any) -> CameraInfo:
        """Return the calibration of a message of ROS 1 or 2, of any library, or of a mapping.

        Raises:
            PerceptionError: for fields that are missing or contradict each other.
        """
        if not isinstance(info, Mapping):
            info = {name: getattr(info, name) for name in _KEYS if hasattr(info, name)}
        try:
            fields = _by_name(info)
            _check_names(fields)
            coefficients = np.ravel(_entries(fields.get("distortion_coefficients")))
            model = _model(fields, coefficients)
            return cls(
                # Zeros of an uncalibrated driver are refused for their matrix.
                fields["image_width"] and pixel_count("image_width", fields["image_width"]),
                fields["image_height"] and pixel_count("image_height", fields["image_height"]),
                _matrix("camera_matrix", _entries(fields["camera_matrix"]), (3, 3)),
                _without_spare_zeros(coefficients, _COUNTS.get(model, ())),
                model,
                _projection(_entries(fields.get("projection_matrix"))),
                _roi(fields.get("roi")),
                (_binning(fields, "binning_x"), _binning(fields, "binning_y")),
            )
        except KeyError as missing:
            raise PerceptionError(
                f"lacks the key {missing}; a camera_info file has image_width, image_height, "
                f"camera_matrix and distortion_coefficients, this one {', '.join(map(str, info))}"
            ) from None
        except (TypeError, ValueError, OverflowError, AttributeError) as cause:
            raise PerceptionError(str(cause)) from cause

    def seen(
        self, image_size_px: tuple[int, int] | None = None, *, rectified: bool = False
    ) -> tuple[tuple[int, int, float, float, float, float], FloatArray]:
        """Return width, height, fx, fy, cx, cy and the coefficients of the delivered images.

        Args:
            image_size_px: width and height of the images; None for what ``roi`` and ``binning``
                say. Images of the full size are taken as such. Where nothing is cut off, any other
                size gets the numbers of the full size.
            rectified: whether the images are rectified: P without distortion, not K.

        Raises:
            PerceptionError: for a matrix that is none, and images that are neither the full one
                nor the part that is delivered.
        """
        matrix, coefficients = self.matrix, self.coefficients
        if rectified:
            if self.projection.any():
                matrix = self.projection[:, :3]
            elif coefficients.any() or self.model != PINHOLE:
                raise PerceptionError(
                    "the images are rectified, so the projection matrix P is needed, which is "
                    "zero: calibrate with camera_calibration, or use the raw images"
                )
            coefficients = np.zeros(0)
        fx, fy, cx, cy = self._checked(matrix, "P" if matrix is not self.matrix else "K")
        x, y, *delivered = self._part()
        size = [math.floor(n / by) for n, by in zip(delivered, self.binning, strict=True)]
        if image_size_px is not None:
            exact = zip(image_size_px, delivered, self.binning, strict=True)
            if all(abs(given * by - n) < by for given, n, by in exact):
                size = list(image_size_px)
            elif (x, y, *delivered) == (0, 0, self.width_px, self.height_px) or (
                tuple(image_size_px) == (self.width_px, self.height_px) and self._is_part_of_full
            ):
                return (self.width_px, self.height_px, fx, fy, cx, cy), coefficients
            else:
                raise PerceptionError(
                    f"the calibration is for {self.width_px} x {self.height_px} px, of which "
                    f"roi and binning leave {size[0]} x {size[1]} px, but the images have "
                    f"{image_size_px[0]} x {image_size_px[1]} px"
                )
        over, down = self.binning
        # Pixel centres are at whole numbers, so the principal point scales about (−0.5, −0.5).
        return (
            size[0],
            size[1],
            fx / over,
            fy / down,
            (cx - x + 0.5) / over - 0.5,
            (cy - y + 0.5) / down - 0.5,
        ), coefficients

    @property
    def _is_part_of_full(self) -> bool:
        x, y, width, height = self.roi_px
        return x + width <= self.width_px and y + height <= self.height_px

    def _part(self) -> tuple[int, int, int, int]:
        """Return x, y, width and height of what is delivered, in pixels before the binning."""
        if not any(self.roi_px):
            return 0, 0, self.width_px, self.height_px
        width, height = self.roi_px[2:]
        # Some drivers (Baxter's cameras) set width and height to those of the part, not of the
        # full image. The offsets still count from the full image, as K does.
        of_part = any(
            abs(self.width_px * over - width) < over and abs(self.height_px * down - height) < down
            for over, down in ((1, 1), self.binning)
        )
        lowest = min(*self.roi_px[:2], width - 1, height - 1)
        if not (self._is_part_of_full or of_part) or lowest < 0:
            raise PerceptionError(
                f"roi (x, y, width, height) = {self.roi_px} px is not a part of the image of "
                f"{self.width_px} x {self.height_px} px"
            )
        return self.roi_px

    def _checked(self, matrix: FloatArray, name: str) -> tuple[float, float, float, float]:
        """Return fx, fy, cx and cy of a matrix that is one of a pinhole in pixels."""
        (fx, skew, cx), (low, fy, cy), last = matrix.tolist()
        if not (np.isfinite(matrix).all() and matrix.any()):
            raise PerceptionError(f"the matrix {name} is zero or not finite: calibrate the camera")
        if last != [0.0, 0.0, 1.0] or low != 0.0:
            transposed = matrix[:2, 2].tolist() == [0.0, 0.0] and skew == 0.0
            raise PerceptionError(
                f"the matrix {name} must be [fx, 0, cx, 0, fy, cy, 0, 0, 1], got "
                f"{matrix.ravel().tolist()}{': is it transposed?' if transposed else ''}"
            )
        if abs(skew) > _LARGEST_SKEW * abs(fx):
            raise PerceptionError(f"the matrix {name} must have no skew, got {skew:g} px")
        for focal, extent in ((fx, self.width_px), (fy, self.height_px)):
            if 0.0 < focal < _SHORTEST_FOCAL * extent:
                raise PerceptionError(
                    f"the matrix {name} must be in pixels, got a focal length of {focal:g} for "
                    f"{extent} px: is it in units of the image size, or in millimetres?"
                )
        size = self.width_px, self.height_px
        whole = self.roi_px in ((0, 0, 0, 0), (0, 0, *size))
        off = [abs(at / max(n, 1) - 0.5) for at, n in zip((cx, cy), size, strict=True)]
        if whole and min(off) > _OFF_CENTRE:
            raise PerceptionError(
                f"the matrix {name} has its principal point, {cx:g}, {cy:g}, at a corner of "
                f"{self.width_px} x {self.height_px} px or beyond: is it in pixels, and for images "
                "of this size? For images that are cut out, give the full size and roi"
            )
        return fx, fy, cx, cy


def _by_name(info: Mapping[Any, Any]) -> dict[Any, Any]:
    """Return the fields under their names in a file."""
    fields: dict[Any, Any] = {}
    for key, value in info.items():
        name = _KEYS.get(key, key)
        if name in fields and not np.array_equal(_entries(fields[name]), _entries(value)):
            raise PerceptionError(f"has {name} twice, with other numbers the second time: {key}")
        fields[name] = value
    return fields


def _entries(value: Any) -> FloatArray:
    """Return the numbers of a ROS matrix: a mapping with ``data``, a list, or none."""
    numbers = value["data"] if isinstance(value, Mapping) else value
    return np.asarray([] if numbers is None else numbers, dtype=np.float64)


def _roi(roi: Any) -> tuple[int, int, int, int]:
    """Return x, y, width and height of a RegionOfInterest."""
    if roi is None:
        return 0, 0, 0, 0
    x, y, width, height = (
        int(roi[name] if isinstance(roi, Mapping) else getattr(roi, name))
        for name in ("x_offset", "y_offset", "width", "height")
    )
    return x, y, width, height


def _binning(fields: Mapping[Any, Any], name: str) -> int:
    """Return the number of pixels that are joined; 0 means 1."""
    return pixel_count(name, fields.get(name) or 1)


def _projection(entries: FloatArray) -> FloatArray:
    return _matrix("projection_matrix", entries, (3, 4)) if entries.size else np.zeros((3, 4))


def _matrix(name: str, entries: FloatArray, shape: tuple[int, int]) -> FloatArray:
    if entries.size != math.prod(shape):
        raise PerceptionError(f"{name} must have {math.prod(shape)} numbers, got {entries.size}")
    return entries.reshape(shape)


def _check_names(fields: Mapping[Any, Any]) -> None:
    """Refuse names under which a distortion may be hidden, which would be lost without a word."""
    others = [str(key) for key in fields if key not in _READ]
    if fields.get("distortion_coefficients") is not None:
        others = [key for key in others if _DISTORTION_KEY.search(key)]
    if others and "camera_matrix" in fields:
        raise PerceptionError(
            f"the key {', '.join(others)} is not read: the coefficients of the lens distortion "
            "belong into distortion_coefficients (an empty list for none), and the name of their "
            "model into distortion_model"
        )


def _model(fields: Mapping[str, Any], coefficients: FloatArray) -> str:
    """Return the distortion model; the calibrator says ``camera_model: fisheye`` instead."""
    found = set()
    for key in ("distortion_model", "camera_model"):
        name = str(fields.get(key) or "").strip().lower().replace("-", "_").replace(" ", "_")
        if name in _FISHEYE_NAMES:
            found.add(FISHEYE)
        elif name in _PINHOLE_NAMES or (name in _NO_DISTORTION[1:] and key == "distortion_model"):
            found.add(PINHOLE)
            if name in _NO_DISTORTION and coefficients.any():
                raise PerceptionError(
                    f"distortion_model is {name!r}, but there are distortion_coefficients "
                    f"{coefficients.tolist()}: name their model"
                )
        elif name not in _NO_DISTORTION:
            return name
    if len(found) > 1:
        raise PerceptionError(
            f"camera_model {fields['camera_model']!r} and distortion_model "
            f"{fields['distortion_model']!r} contradict each other"
        )
    return found.pop() if found else PINHOLE


def _without_spare_zeros(coefficients: FloatArray, counts: tuple[int, ...]) -> FloatArray:
    """Return the coefficients without zeros at the end that are more than a model has."""
    while counts and len(coefficients) not in counts and coefficients[-1] == 0.0:
        coefficients = coefficients[:-1]
    return coefficients


def _is_of_opencv(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            start = file.read(4096)
    except OSError:
        return False
    return b"opencv" in start or start.startswith(b"%YAML:")  # YAML itself has a blank there
