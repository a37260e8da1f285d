"""Flat views cut from an image of a wide lens, with the same optical centre."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from .._camera import Camera
from .._observation import PersonObservation
from ..arrays import FloatArray, finite_array, rotation_matrix, set_fields
from ..errors import PerceptionError
from ._lenses import WideLens

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
        """Return the observation in the camera frame; its box stays in pixels of the view."""
        R = self.rotation_camera_view
        gaze = observation.gaze_camera
        covariance = R @ observation.position_covariance_m2 @ R.T
        return replace(
            observation,
            position_camera_m=R @ observation.position_camera_m,
            position_covariance_m2=0.5 * (covariance + covariance.T),
            gaze_camera=None if gaze is None else R @ gaze,
        )

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
