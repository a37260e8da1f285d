"""Lenses with a wider view than a pinhole: from directions to pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from .._camera_info import FISHEYE, CameraInfo
from ..arrays import FloatArray, finite_array, finite_number, pixel_count, set_fields
from ..errors import PerceptionError

_DEFAULT_MAX_ANGLE_RAD: Final = math.radians(100.0)


class WideLens(Protocol):
    """Interface of a lens: maps directions to pixels, also beyond 90° from the axis."""

    @property
    def width_px(self) -> int:
        """Width of the image."""
        ...

    @property
    def height_px(self) -> int:
        """Height of the image."""
        ...

    def project(self, points_camera_m: Any) -> FloatArray:
        """Project points (N, 3) in the camera frame to pixels (N, 2); NaN where it does not see."""
        ...


@dataclass(frozen=True, eq=False)
class FisheyeLens:
    """A fisheye lens: the Kannala–Brandt model of OpenCV's ``fisheye`` and ROS's ``equidistant``.

    A ray at the angle θ from the axis falls θ (1 + k₁θ² + k₂θ⁴ + k₃θ⁶ + k₄θ⁸) focal lengths from
    the principal point (Kannala and Brandt 2006, doi:10.1109/TPAMI.2006.153).

    Attributes:
        width_px: image width, > 0.
        height_px: image height, > 0.
        fx_px: pixels per radian along u, > 0.
        fy_px: pixels per radian along v, > 0.
        cx_px: principal point, u.
        cy_px: principal point, v.
        coefficients: (4,) k₁ to k₄; default 0.
        max_angle_rad: angle at which the image circle ends, in (0, π]. The polynomial must grow up
            to this angle.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    coefficients: FloatArray | None = None
    max_angle_rad: float = _DEFAULT_MAX_ANGLE_RAD

    def __post_init__(self) -> None:
        given = np.zeros(4) if self.coefficients is None else np.ravel(self.coefficients)
        coefficients = finite_array("coefficients", given, (4,))
        angle = finite_number(
            "max_angle_rad", self.max_angle_rad, minimum=0.0, exclusive_minimum=True
        )
        if angle > math.pi:
            raise PerceptionError(f"max_angle_rad must lie in (0, pi], got {angle:g} rad")
        radii = _fisheye_radius(np.linspace(0.0, angle, 256), coefficients)
        if not (np.diff(radii) > 0.0).all():
            raise PerceptionError(
                f"the fisheye polynomial of {coefficients.tolist()} must grow up to max_angle_rad "
                f"= {angle:g} rad, or two directions share a pixel; give the angle at which the "
                "image circle ends"
            )
        set_fields(
            self,
            **{name: pixel_count(name, getattr(self, name)) for name in ("width_px", "height_px")},
            **{
                name: finite_number(name, getattr(self, name), minimum=0.0, exclusive_minimum=True)
                for name in ("fx_px", "fy_px")
            },
            cx_px=finite_number("cx_px", self.cx_px),
            cy_px=finite_number("cy_px", self.cy_px),
            coefficients=coefficients,
            max_angle_rad=angle,
        )

    @classmethod
    def from_yaml(
        cls, path: str | Path, max_angle_rad: float = _DEFAULT_MAX_ANGLE_RAD
    ) -> FisheyeLens:
        """Read a ROS camera_info YAML file of a fisheye: ``distortion_model: equidistant``.

        ``camera_calibration`` writes ``camera_model: fisheye`` instead.

        Raises:
            PerceptionError: for a file that cannot be read, is not complete, or has another
                distortion model (:meth:`perception.Camera.from_yaml` reads pinhole models); the
                message names the file.
        """
        info = CameraInfo.from_yaml(path)
        if info.model != FISHEYE:
            raise PerceptionError(
                f"{path}: distortion_model of a fisheye must be {FISHEYE} (or camera_model: "
                f"fisheye), got {info.model!r}; Camera.from_yaml reads others"
            )
        try:
            intrinsics, coefficients = info.seen()
            return cls(*intrinsics, coefficients if coefficients.size else None, max_angle_rad)
        except PerceptionError as cause:
            raise PerceptionError(f"{path}: {cause}") from cause

    def project(self, points_camera_m: Any) -> FloatArray:
        """Project points (N, 3) in the camera frame to pixels (N, 2); NaN past the image circle."""
        x, y, z = finite_array("points_camera_m", points_camera_m, ("N", 3)).T
        across = np.hypot(x, y)
        angle = np.arctan2(across, z)
        assert self.coefficients is not None  # set by the constructor
        radius = _fisheye_radius(angle, self.coefficients)
        share = np.divide(radius, across, out=np.zeros_like(radius), where=across > 0.0)
        pixels = np.column_stack(
            (self.fx_px * share * x + self.cx_px, self.fy_px * share * y + self.cy_px)
        )
        pixels[(angle > self.max_angle_rad) | ((across == 0.0) & (z <= 0.0))] = np.nan
        return pixels


@dataclass(frozen=True, slots=True)
class PanoramaLens:
    """An equirectangular panorama of the whole sphere, the format of 360° cameras.

    The camera's z axis is in the middle of the image, the direction to its left a quarter of the
    width further left. The left and right borders of the image meet behind the camera.

    Attributes:
        width_px: image width, which covers 360°, > 0.
        height_px: image height, which covers 180°, > 0.
    """

    width_px: int
    height_px: int

    def __post_init__(self) -> None:
        for name in ("width_px", "height_px"):
            set_fields(self, **{name: pixel_count(name, getattr(self, name))})

    def project(self, points_camera_m: Any) -> FloatArray:
        """Project points (N, 3) in the camera frame to pixels (N, 2), u in −0.5 … width − 0.5."""
        x, y, z = finite_array("points_camera_m", points_camera_m, ("N", 3)).T
        aside = np.arctan2(x, z) / (2.0 * math.pi)
        down = np.arctan2(y, np.hypot(x, z)) / math.pi
        return np.column_stack(
            ((0.5 + aside) * self.width_px - 0.5, (0.5 + down) * self.height_px - 0.5)
        )


def _fisheye_radius(angle_rad: FloatArray, coefficients: FloatArray) -> FloatArray:
    """Return the distance from the principal point, in focal lengths, of rays at these angles."""
    square = angle_rad * angle_rad
    k1, k2, k3, k4 = coefficients.tolist()
    factor = 1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4)))
    return np.asarray(angle_rad * factor)
