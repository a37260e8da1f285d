"""The pinhole camera with lens distortion, in the conventions of ROS and OpenCV."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import yaml

from ._camera_info import read_camera_info
from .arrays import FloatArray, finite_array, finite_number, pixel_count, set_fields
from .errors import PerceptionError

# Numbers of coefficients that OpenCV accepts: plumb_bob has 5, rational_polynomial 8.
_DISTORTION_SIZES: Final = (4, 5, 8, 12, 14)
_DISTORTION_MODELS: Final = ("plumb_bob", "rational_polynomial")
# Intrinsics beyond these are errors of whoever sent them, and products with them may overflow.
_SHORTEST_PX: Final = 1e-6
_LONGEST_PX: Final = 1e9


@dataclass(frozen=True, eq=False)
class Camera:
    """A calibrated camera in the optical frame (x right, y down, z forward).

    Pixel centres lie at integer coordinates, so the image spans −0.5 to width − 0.5 (OpenCV's
    convention).

    Attributes:
        width_px: image width, > 0.
        height_px: image height, > 0.
        fx_px: focal length along u, 1e-6 to 1e9.
        fy_px: focal length along v, likewise.
        cx_px: principal point, u, −1e9 to 1e9.
        cy_px: principal point, v, likewise.
        distortion: OpenCV's coefficients k1, k2, p1, p2, k3, … (4, 5, 8, 12 or 14), or None.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: FloatArray | None = None

    def __post_init__(self) -> None:
        size = {name: pixel_count(name, getattr(self, name)) for name in ("width_px", "height_px")}
        distortion = self.distortion
        if distortion is not None:
            distortion = finite_array("distortion", np.ravel(distortion), ("N",))
            if distortion.size not in _DISTORTION_SIZES:
                raise PerceptionError(
                    f"distortion must have {', '.join(map(str, _DISTORTION_SIZES))} coefficients, "
                    f"got {distortion.size}"
                )
            if not np.any(distortion):
                distortion = None
        set_fields(
            self,
            **size,
            distortion=distortion,
            **{
                name: finite_number(name, getattr(self, name), minimum=low, maximum=_LONGEST_PX)
                for low, names in (
                    (-_LONGEST_PX, ("cx_px", "cy_px")),
                    (_SHORTEST_PX, ("fx_px", "fy_px")),
                )
                for name in names
            },
        )

    @classmethod
    def from_fov(cls, width_px: int, height_px: int, horizontal_fov_rad: float) -> Camera:
        """Return a camera with square pixels and the principal point at (width/2, height/2).

        Args:
            width_px: image width.
            height_px: image height.
            horizontal_fov_rad: horizontal field of view, in (0, π).

        Raises:
            PerceptionError: for an invalid value.
        """
        fov = finite_number(
            "horizontal_fov_rad", horizontal_fov_rad, minimum=0.0, exclusive_minimum=True
        )
        if fov >= math.pi:
            raise PerceptionError(f"horizontal_fov_rad must lie in (0, pi), got {fov:g} rad")
        focal = 0.5 * width_px / math.tan(0.5 * fov)
        return cls(width_px, height_px, focal, focal, 0.5 * width_px, 0.5 * height_px)

    @classmethod
    def from_yaml(cls, path: str | Path) -> Camera:
        """Read a ROS camera_info YAML file.

        The file may be written by ``camera_calibration`` (``camera_matrix`` and so on), or be a
        ``sensor_msgs/CameraInfo`` message as ``ros2 topic echo`` prints it (``k``, ``d``). The
        distortion models plumb_bob and rational_polynomial are accepted.

        Raises:
            PerceptionError: for a file that cannot be read, is not complete, or has another
                distortion model; the message names the file.
        """
        info = read_camera_info(path)
        if np.any(info.coefficients) and info.model not in _DISTORTION_MODELS:
            raise PerceptionError(
                f"{path}: distortion_model must be one of {', '.join(_DISTORTION_MODELS)}, "
                f"got {info.model!r}; rectify the images first, or use perception.surround for a "
                "fisheye camera"
            )
        try:
            return cls(
                *info.intrinsics,
                info.coefficients if info.coefficients.size else None,
            )
        except ValueError as cause:
            raise PerceptionError(f"{path}: {cause}") from cause

    def to_yaml(self, path: str | Path) -> None:
        """Write a ROS ``camera_info`` YAML file that :meth:`from_yaml` reads back."""
        coefficients = [0.0] * 5 if self.distortion is None else self.distortion.tolist()
        data = {
            "image_width": self.width_px,
            "image_height": self.height_px,
            "camera_name": "camera",
            "camera_matrix": {"rows": 3, "cols": 3, "data": self.matrix.ravel().tolist()},
            "distortion_model": "plumb_bob" if len(coefficients) <= 5 else "rational_polynomial",
            "distortion_coefficients": {
                "rows": 1,
                "cols": len(coefficients),
                "data": coefficients,
            },
        }
        Path(path).write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")

    @cached_property
    def matrix(self) -> FloatArray:
        """Intrinsic matrix (3, 3)."""
        matrix = np.array(
            [[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]]
        )
        matrix.setflags(write=False)
        return matrix

    def project(self, points_camera_m: Any) -> FloatArray:
        """Project points (N, 3) in the camera frame to pixels (N, 2), lens distortion included.

        The row of a point at z ≤ 0, which has no image, is NaN.
        """
        points = finite_array("points_camera_m", points_camera_m, ("N", 3))
        ahead = points[:, 2] > 0.0
        pixels = np.full((len(points), 2), np.nan)
        if not ahead.any():
            return pixels
        if self.distortion is None:
            front = points[ahead]
            pixels[ahead] = front[:, :2] / front[:, 2:] * (self.fx_px, self.fy_px) + (
                self.cx_px,
                self.cy_px,
            )
        else:
            image, _ = cv2.projectPoints(
                points[ahead], np.zeros(3), np.zeros(3), self.matrix, self.distortion
            )
            pixels[ahead] = image.reshape(-1, 2)
        return pixels

    def normalise(self, pixels_px: Any) -> FloatArray:
        """Return rays x/z, y/z (N, 2) of pixels (N, 2), with intrinsics and distortion removed."""
        pixels = finite_array("pixels_px", pixels_px, ("N", 2))
        if self.distortion is None or not len(pixels):
            return np.asarray(
                (pixels - (self.cx_px, self.cy_px)) / (self.fx_px, self.fy_px), dtype=np.float64
            )
        undistorted = cv2.undistortPoints(pixels.reshape(-1, 1, 2), self.matrix, self.distortion)
        return np.asarray(undistorted, dtype=np.float64).reshape(-1, 2)
