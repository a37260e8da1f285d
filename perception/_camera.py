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

from ._camera_info import PINHOLE, CameraInfo
from .arrays import FloatArray, finite_array, finite_number, pixel_count, set_fields
from .errors import PerceptionError

_WIDEST_RAD: Final = math.radians(89.9)
# No lens brings the picture further in, as a share of the angle, nor further out where a lens that
# projects at f sin θ would not: none bends more outwards than that one, but for calibration.
_MOST_BENT: Final = 1.0 / 3.0
_CALIBRATED: Final = 1.15
# The bend is looked at in so many rays on the way to each corner and the middle of each side.
_ALONG: Final = 128
_SAMPLES: Final = 2048
_ITERATIONS: Final = 6
_EXACT_PX: Final = 1e-6
_CONVERGED_PX: Final = 1e-3
# Rays at the very end of the model cannot be moved outwards to measure a scale.
_INSIDE: Final = 0.99


class LensModel:
    """The distortion of a pinhole camera, from rays x/z, y/z to pixels and back.

    Far enough from the axis, many polynomials turn back: two rays would share a pixel. There the
    model ends, and nothing beyond is an image.

    Args:
        matrix: (3, 3).
        distortion: OpenCV's coefficients.

    Attributes:
        end: radius x/z, y/z at which the model ends; the tangent of 89.9° if it does not before.
    """

    def __init__(self, matrix: FloatArray, distortion: FloatArray) -> None:
        self._matrix, self._distortion = matrix, distortion
        k1, k2, _, _, k3, k4, k5, k6 = np.append(distortion, np.zeros(8))[:8].tolist()
        radii = np.tan(np.linspace(0.0, _WIDEST_RAD, _SAMPLES))
        s = radii * radii
        with np.errstate(divide="ignore", invalid="ignore"):
            image = radii * (1.0 + s * (k1 + s * (k2 + s * k3)))
            image /= 1.0 + s * (k4 + s * (k5 + s * k6))
        turns = np.flatnonzero(~(np.diff(image) > 0.0))
        count = int(turns[0]) + 1 if len(turns) else _SAMPLES
        self._radii, self._image = radii[:count], image[:count]
        self.end = float(self._radii[-1])

    def no_lens(self, width_px: int, height_px: int) -> tuple[float, float] | None:
        """Return :func:`bent_too_far` of the rays in a picture of this size."""
        radii = self._radii[1 :: len(self._radii) // _ALONG + 1]
        if not len(radii):  # the model ends at its axis
            return 0.0, 0.0
        radii = np.concatenate((radii[0] * np.geomspace(1e-6, 0.5, _ALONG // 8), radii))
        sides = np.array(
            [[x, y] for x in (0.0, 0.5, 1.0) for y in (0.0, 0.5, 1.0) if x * y != 0.25]
        )
        across = (sides * (width_px, height_px) - self._matrix[:2, 2]) / self._matrix.diagonal()[:2]
        across /= np.hypot(*across.T)[:, None] + 1e-12
        rays = (radii[:, None, None] * across).reshape(-1, 2)
        pixels, _ = self.project(rays)
        inside = ((pixels >= -0.5) & (pixels <= (width_px - 0.5, height_px - 0.5))).all(axis=1)
        reach = np.hypot(*((pixels - self._matrix[:2, 2]) / self._matrix.diagonal()[:2]).T)
        return bent_too_far(np.arctan(np.hypot(*rays.T))[inside], reach[inside])

    def project(self, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the pixels (N, 2) of rays (N, 2), and their derivatives (N, 2, 2)."""
        points = np.column_stack((rays, np.ones(len(rays))))
        pixels, derivatives = cv2.projectPoints(
            points, np.zeros(3), np.zeros(3), self._matrix, self._distortion
        )
        # At z = 1, a shift of the camera is a shift of the ray.
        slopes = np.asarray(derivatives[:, 3:5], dtype=np.float64).reshape(-1, 2, 2)
        return np.asarray(pixels, dtype=np.float64).reshape(-1, 2), slopes

    def rays(self, pixels_px: FloatArray, *, nearest: bool) -> FloatArray:
        """Return the rays (N, 2) of pixels (N, 2), by Newton's method.

        Pixels beyond the end of the model are NaN, or those of the end with ``nearest``.
        """
        centred = (pixels_px - self._matrix[:2, 2]) / self._matrix.diagonal()[:2]
        reach = np.hypot(*centred.T)
        radius = np.interp(reach, self._image, self._radii)
        rays = start = centred * (radius / np.maximum(reach, 1e-12))[:, None]
        off = np.zeros_like(rays)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for _ in range(_ITERATIONS):
                image, slopes = self.project(rays)
                (a, b), (c, d) = slopes.transpose(1, 2, 0)
                off = pixels_px - image
                if np.abs(off).max() < _EXACT_PX:
                    break
                step = np.stack((d * off[:, 0] - b * off[:, 1], a * off[:, 1] - c * off[:, 0]))
                moved = rays + (step / (a * d - b * c)).T
                moved = np.where(np.isfinite(moved), moved, start)
                length = np.maximum(np.hypot(*moved.T), 1e-12)
                rays = moved * np.minimum(1.0, self.end / length)[:, None]
        beyond = np.abs(off).max(axis=1) > _CONVERGED_PX
        if beyond.any():
            rays = np.where(beyond[:, None], _INSIDE * start if nearest else np.nan, rays)
        return np.asarray(rays, dtype=np.float64)


def bent_too_far(angle_rad: FloatArray, reach: FloatArray) -> tuple[float, float] | None:
    """Return the worst ray that no lens bends so; None if a lens may bend all of them so.

    Args:
        angle_rad: (N,) angles of rays from the axis, in the picture.
        reach: (N,) how far from the principal point they fall, in focal lengths.

    Returns:
        The angle of the ray, and the one at which a pinhole would have seen its pixel, rad.
    """
    pinhole = np.arctan(reach)
    share = angle_rad / np.maximum(pinhole, 1e-12)
    outermost = _CALIBRATED * np.arcsin(np.minimum(reach, 1.0))
    wrong = (share < 1.0 - _MOST_BENT) | ((share > 1.0 + _MOST_BENT) & (angle_rad > outermost))
    if not wrong.any():
        return None
    worst = int(np.argmax(np.where(wrong, np.abs(np.log(np.maximum(share, 1e-12))), -1.0)))
    return float(angle_rad[worst]), float(pinhole[worst])


# Numbers of coefficients that OpenCV accepts: plumb_bob has 5, rational_polynomial 8.
_DISTORTION_SIZES: Final = (4, 5, 8, 12, 14)
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

    Raises:
        PerceptionError: for values out of these bounds, and a distortion that no lens has: one
            that bends the field by more than a third inside the picture. Outwards, lenses bend up
            to f sin θ, however much that is.
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
        if self._lens and (wrong := self._lens.no_lens(self.width_px, self.height_px)):
            seen_deg, pinhole_deg = np.degrees(wrong).tolist()
            assert distortion is not None
            raise PerceptionError(
                f"the distortion {distortion.tolist()} is that of no lens: a ray {seen_deg:.1f} "
                f"degrees off the axis would fall on the pixel that has {pinhole_deg:.1f} without "
                "it, and no lens bends more than a third so. Often a driver sends the first five "
                "coefficients of a model with eight (rational_polynomial), or those of another "
                "model: calibrate with camera_calibration, or use rectified images (image_rect)"
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
            raise PerceptionError(
                f"horizontal_fov_rad must lie in (0, pi), got {fov:g}; is it in degrees?"
            )
        focal = 0.5 * width_px / math.tan(0.5 * fov)
        return cls(width_px, height_px, focal, focal, 0.5 * width_px, 0.5 * height_px)

    @classmethod
    def from_camera_info(
        cls,
        info: Any,
        *,
        rectified: bool = False,
        image_size_px: tuple[int, int] | None = None,
    ) -> Camera:
        """Return the camera of the images that a ``sensor_msgs/CameraInfo`` comes with.

        K, D and P are for the full image: ``roi`` and ``binning`` lead to the delivered one.

        Args:
            info: a message of any library, or a mapping with its fields.
            rectified: whether the images are rectified (``image_rect``): P counts, without
                distortion, and not K and D.
            image_size_px: width and height of the images, which may be the full ones; None for
                what ``roi`` and ``binning`` say.

        Raises:
            PerceptionError: for fields that are missing or contradict each other or the images,
                or a distortion model other than plumb_bob and rational_polynomial.
        """
        return cls._of(CameraInfo.of(info), rectified, image_size_px)

    @classmethod
    def from_yaml(
        cls,
        path: str | Path,
        *,
        rectified: bool = False,
        image_size_px: tuple[int, int] | None = None,
    ) -> Camera:
        """Read a ROS camera_info YAML file.

        The file may be written by ``camera_calibration`` (``camera_matrix`` and so on), or be a
        ``sensor_msgs/CameraInfo`` message as ``ros2 topic echo`` prints it (``k``, ``d``).

        Args:
            path: of the file.
            rectified: as in :meth:`from_camera_info`.
            image_size_px: likewise.

        Raises:
            PerceptionError: for a file that cannot be read, and what :meth:`from_camera_info`
                refuses; the message names the file.
        """
        info = CameraInfo.from_yaml(path)
        try:
            return cls._of(info, rectified, image_size_px)
        except PerceptionError as cause:
            raise PerceptionError(f"{path}: {cause}") from cause

    @classmethod
    def _of(
        cls, info: CameraInfo, rectified: bool, image_size_px: tuple[int, int] | None
    ) -> Camera:
        if info.model != PINHOLE and not rectified:
            raise PerceptionError(
                "distortion_model must be plumb_bob or rational_polynomial, got "
                f"{info.model!r}; rectify the images and use their topic (image_rect), or use "
                "perception.surround for a fisheye camera"
            )
        intrinsics, coefficients = info.seen(image_size_px, rectified=rectified)
        return cls(*intrinsics, coefficients if coefficients.size else None)

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

        The row of a point at z ≤ 0, or beyond the end of the distortion model, is NaN: it has no
        image.
        """
        points = finite_array("points_camera_m", points_camera_m, ("N", 3))
        ahead = points[:, 2] > 0.0
        pixels = np.full((len(points), 2), np.nan)
        if not ahead.any():
            return pixels
        rays = points[ahead, :2] / points[ahead, 2:]
        if self._lens is None:
            pixels[ahead] = rays * (self.fx_px, self.fy_px) + (self.cx_px, self.cy_px)
        else:
            image, _ = self._lens.project(rays)
            image[np.hypot(*rays.T) > self._lens.end] = np.nan
            pixels[ahead] = image
        return pixels

    def normalise(self, pixels_px: Any, *, nearest: bool = False) -> FloatArray:
        """Return rays x/z, y/z (N, 2) of pixels (N, 2), with intrinsics and distortion removed.

        Args:
            pixels_px: (N, 2).
            nearest: for pixels beyond the end of the distortion model, which have no ray, return
                a ray at its end instead of NaN: a bound, not a measurement.
        """
        pixels = finite_array("pixels_px", pixels_px, ("N", 2))
        if self._lens is None or not len(pixels):
            return np.asarray(
                (pixels - (self.cx_px, self.cy_px)) / (self.fx_px, self.fy_px), dtype=np.float64
            )
        return self._lens.rays(pixels, nearest=nearest)

    @cached_property
    def _lens(self) -> LensModel | None:
        return None if self.distortion is None else LensModel(self.matrix, self.distortion)
