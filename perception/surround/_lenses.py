"""Lenses with a wider view than a pinhole, and flat views with the same optical centre."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from .._camera import Camera, bent_too_far
from .._camera_info import FISHEYE, CameraInfo
from .._observation import PersonObservation
from ..arrays import (
    FloatArray,
    finite_array,
    finite_number,
    pixel_count,
    rotation_matrix,
    set_fields,
)
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
        angles = np.linspace(0.0, angle, 256)
        radii = _fisheye_radius(angles, coefficients)
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
        # Beyond a right angle there is no pinhole to compare with.
        farthest = math.hypot(self.width_px / self.fx_px, self.height_px / self.fy_px)
        ahead = (angles > 0.0) & (angles < 0.5 * math.pi) & (radii <= farthest)
        if wrong := bent_too_far(angles[ahead], radii[ahead]):
            seen_deg, pinhole_deg = np.degrees(wrong).tolist()
            raise PerceptionError(
                f"the fisheye coefficients {coefficients.tolist()} are those of no lens: a ray "
                f"{seen_deg:.1f} degrees off the axis would fall where a pinhole has "
                f"{pinhole_deg:.1f}; are they of another model, or in another order?"
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


# Points per side with which the outline of a box is mapped from a view to the lens's image.
_BOX_POINTS: Final = 9


@dataclass(frozen=True, eq=False)
class FlatView:
    """A flat (pinhole) view cut from an image of a wide lens, with the same optical centre.

    Attributes:
        camera: pinhole camera of the flat view.
        rotation_camera_view: (3, 3) from the view's optical frame to the camera frame.
    """

    camera: Camera
    rotation_camera_view: FloatArray

    def __post_init__(self) -> None:
        if not isinstance(self.camera, Camera):
            raise PerceptionError(f"camera must be a Camera, got {type(self.camera).__name__}")
        rotation = rotation_matrix("rotation_camera_view", self.rotation_camera_view)
        set_fields(self, rotation_camera_view=rotation)

    @cached_property
    def T_camera_view(self) -> FloatArray:  # noqa: N802
        """The rotation as a transform (4, 4): ``T_odom_view = T_odom_camera @ T_camera_view``."""
        transform = np.eye(4)
        transform[:3, :3] = self.rotation_camera_view
        transform.setflags(write=False)
        return transform

    def in_camera(self, observation: PersonObservation) -> PersonObservation:
        """Return the observation in the camera frame; its pixels stay those of the view."""
        return observation.rotated(self.rotation_camera_view)

    def sampling_maps(self, lens: WideLens) -> tuple[FloatArray, FloatArray]:
        """Return the maps u, v (H, W), float32, of the view's pixels in the lens's image."""
        columns, rows = np.meshgrid(
            np.arange(self.camera.width_px, dtype=float), np.arange(self.camera.height_px)
        )
        pixels = lens.project(self._rays(np.column_stack((columns.ravel(), rows.ravel()))))
        # Far outside the image, cv2.remap samples black.
        pixels = np.where(np.isnan(pixels), -10.0, pixels).astype(np.float32)
        shape = (self.camera.height_px, self.camera.width_px)
        return pixels[:, 0].reshape(shape), pixels[:, 1].reshape(shape)

    def box_in(self, lens: WideLens, box_xyxy_px: FloatArray) -> FloatArray | None:
        """Return the bounding box, in the lens's image, of a box of the view.

        It is None if the lens does not see the whole outline of the box, or the box lies across the
        seam of a panorama.
        """
        left, top, right, bottom = box_xyxy_px.tolist()
        u, v = np.linspace(left, right, _BOX_POINTS), np.linspace(top, bottom, _BOX_POINTS)
        outline = np.concatenate(
            [np.column_stack((u, np.full_like(u, y))) for y in (top, bottom)]
            + [np.column_stack((np.full_like(v, x), v)) for x in (left, right)]
        )
        pixels = lens.project(self._rays(outline))
        if not np.isfinite(pixels).all() or np.ptp(pixels[:, 0]) > 0.5 * lens.width_px:
            return None
        limit = np.array([lens.width_px, lens.height_px], dtype=float)
        low, high = np.clip(pixels.min(axis=0), 0.0, limit), np.clip(pixels.max(axis=0), 0.0, limit)
        return np.concatenate([low, high]) if (high > low).all() else None

    def _rays(self, pixels_px: FloatArray) -> FloatArray:
        """Return directions (N, 3) in the camera frame of pixels (N, 2) of the view."""
        rays = self.camera.normalise(pixels_px, nearest=True)
        flat = np.column_stack((rays, np.ones(len(rays))))
        return np.asarray(flat @ self.rotation_camera_view.T)


def ring_of_views(camera: Camera, headings_rad: Any) -> tuple[FlatView, ...]:
    """Return flat views of one pinhole camera, turned about the vertical (the camera's y axis).

    Args:
        camera: pinhole camera of all views. Neighbouring views should overlap by the width of a
            nearby body, about 20°.
        headings_rad: (V,) angles from the camera's axis to the axes of the views, left positive.

    Raises:
        PerceptionError: without headings, or for a non-finite one.
    """
    headings = finite_array("headings_rad", headings_rad, ("V",))
    if not headings.size:
        raise PerceptionError("headings_rad must hold at least one heading, got none")
    views = []
    for heading in headings.tolist():
        cos, sin = math.cos(heading), math.sin(heading)
        rotation = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
        views.append(FlatView(camera, rotation))
    return tuple(views)
