"""Flat views about one optical centre, cut from a wide picture."""

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

# Points a side of a box that is carried from a view to the picture.
_BOX_POINTS: Final = 9


@dataclass(frozen=True, eq=False)
class FlatView:
    """A flat picture cut from a wide one, about the same optical centre.

    Attributes:
        camera: of the flat picture.
        rotation_camera_view: (3, 3), directions in the view's optical frame to the camera's.
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
        """(4, 4) the rotation as a transform: ``T_odom_view = T_odom_camera @ T_camera_view``."""
        transform = np.eye(4)
        transform[:3, :3] = self.rotation_camera_view
        transform.setflags(write=False)
        return transform

    def in_camera(self, observation: PersonObservation) -> PersonObservation:
        """The same observation in the camera's frame; the box stays in the view's pixels."""
        R = self.rotation_camera_view
        gaze = observation.gaze_camera
        covariance = R @ observation.position_covariance_m2 @ R.T
        return replace(
            observation,
            position_camera_m=R @ observation.position_camera_m,
            position_covariance_m2=0.5 * (covariance + covariance.T),
            gaze_camera=None if gaze is None else R @ gaze,
        )

    def cut(self, lens: WideLens) -> tuple[FloatArray, FloatArray]:
        """Where each pixel of the view lies in the lens's picture: two (H, W) float32 maps."""
        columns, rows = np.meshgrid(
            np.arange(self.camera.width_px, dtype=float), np.arange(self.camera.height_px)
        )
        pixels = lens.project(self._rays(np.column_stack((columns.ravel(), rows.ravel()))))
        # Where the lens does not see, the view is black.
        pixels = np.where(np.isnan(pixels), -10.0, pixels).astype(np.float32)
        shape = (self.camera.height_px, self.camera.width_px)
        return pixels[:, 0].reshape(shape), pixels[:, 1].reshape(shape)

    def box_in(self, lens: WideLens, box_xyxy_px: FloatArray) -> FloatArray | None:
        """The box about a box of the view in the lens's picture.

        None where the lens does not see all of its outline, or it lies across the seam of a
        panorama.
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
        """(N, 3) directions in the camera's frame of pixels (N, 2) of the view."""
        flat = np.column_stack((self.camera.normalise(pixels_px), np.ones(len(pixels_px))))
        return np.asarray(flat @ self.rotation_camera_view.T)


def ring_of_views(camera: Camera, headings_rad: Any) -> tuple[FlatView, ...]:
    """Views of one flat camera turned about the camera's vertical (its y axis).

    Args:
        camera: of every view. Neighbours should overlap by the width of a body near by, some 20°.
        headings_rad: (V,) of the views' axes from the camera's, left positive.
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
