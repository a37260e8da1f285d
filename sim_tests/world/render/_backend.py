"""The interface of the renderers: the view that they draw, the drawing, and the base of both.

A view is a pinhole frustum over a grid of samples.
"""

from __future__ import annotations

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from perception import Camera
from perception.arrays import FloatArray, finite_array, rigid_transform

from ..errors import SimError
from ..hall import Colour, Lighting, Mesh

BackendName = Literal["tiny", "gl"]
RendererName = Literal["tiny", "gl", "auto"]
RENDERERS: Final[tuple[RendererName, ...]] = ("tiny", "gl", "auto")

# The software renderer works in single precision: a sample may round to a box's edge.
_SLACK_TANGENT: Final = 1e-4
_SLACK_M: Final = 1e-3
_UNIT_CORNERS: Final = np.array(
    [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
)


@dataclass(frozen=True, slots=True, eq=False)
class RenderView:
    """A rectangle of a camera's image plane, divided into equal cells with a sample in each middle.

    Edges are tangents: the edge ``left`` is the plane x = left · z of the optical frame (x right,
    y down, z forward).

    Attributes:
        T_odom_camera: (4, 4) optical frame to odom.
        left: tangent of the rectangle's left edge.
        right: tangent of its right edge, > left.
        top: tangent of its upper edge.
        bottom: tangent of its lower edge, > top.
        width: samples per row.
        height: samples per column.
        near_m: nothing nearer is drawn.
        far_m: nothing farther is drawn.
    """

    T_odom_camera: FloatArray
    left: float
    right: float
    top: float
    bottom: float
    width: int
    height: int
    near_m: float = 0.05
    far_m: float = 60.0

    @classmethod
    def of_rectangle(
        cls,
        camera: Camera,
        T_odom_camera: Any,
        roi_xyxy_px: Any = None,
        size_px: tuple[int, int] | None = None,
    ) -> RenderView:
        """Return the view of a rectangle of a camera's image.

        Args:
            camera: without distortion.
            T_odom_camera: (4, 4), optical frame to odom.
            roi_xyxy_px: (4,) u_min, v_min, u_max, v_max in pixels from the image's corner; None is
                the whole image.
            size_px: samples per row and per column; None is one per pixel of the rectangle.

        Raises:
            SimError: for a camera with distortion, an empty rectangle or a size below one sample.
        """
        if camera.distortion is not None:
            raise SimError(
                "the renderer makes undistorted images; use a camera with distortion=None"
            )
        T = rigid_transform("T_odom_camera", T_odom_camera, SimError)
        if roi_xyxy_px is None:
            u_min, v_min, u_max, v_max = 0.0, 0.0, float(camera.width_px), float(camera.height_px)
        else:
            u_min, v_min, u_max, v_max = finite_array(
                "roi_xyxy_px", roi_xyxy_px, (4,), SimError
            ).tolist()
        if u_max <= u_min or v_max <= v_min:
            raise SimError(
                "roi_xyxy_px must have u_min < u_max and v_min < v_max, got "
                f"({u_min:g}, {v_min:g}, {u_max:g}, {v_max:g}) px"
            )
        width, height = (
            (math.ceil(u_max - u_min), math.ceil(v_max - v_min)) if size_px is None else size_px
        )
        if width < 1 or height < 1:
            raise SimError(f"size_px must be at least (1, 1), got ({width}, {height})")
        # The image's corner lies half a pixel before the centre of its first pixel.
        return cls(
            T,
            left=(u_min - 0.5 - camera.cx_px) / camera.fx_px,
            right=(u_max - 0.5 - camera.cx_px) / camera.fx_px,
            top=(v_min - 0.5 - camera.cy_px) / camera.fy_px,
            bottom=(v_max - 0.5 - camera.cy_px) / camera.fy_px,
            width=int(width),
            height=int(height),
        )

    @property
    def samples_per_m(self) -> float:
        """The number of samples per metre of a line across the view at 1 m distance."""
        return self.width / (self.right - self.left)

    def finer(self, factor: int) -> RenderView:
        """Return the same rectangle with ``factor`` times the samples in each direction."""
        return replace(self, width=self.width * factor, height=self.height * factor)

    def view_matrix(self) -> list[float]:
        """Return OpenGL's view matrix, column by column: its camera looks along −z with y up."""
        rotation, origin = self.T_odom_camera[:3, :3], self.T_odom_camera[:3, 3]
        out = np.eye(4)
        out[:3, :3] = rotation.T * np.array([[1.0], [-1.0], [-1.0]])
        out[:3, 3] = out[:3, :3] @ -origin
        return [float(value) for value in out.T.flat]

    def projection_matrix(self, shift_samples: tuple[float, float] = (0.0, 0.0)) -> list[float]:
        """Return OpenGL's projection matrix of the frustum, column by column.

        Args:
            shift_samples: moves the frustum right and down by this many cells of the grid, for a
                renderer that does not sample in the middle of a cell.
        """
        near, far = self.near_m, self.far_m
        shift_u = shift_samples[0] * (self.right - self.left) / self.width
        shift_v = shift_samples[1] * (self.bottom - self.top) / self.height
        left, right = self.left + shift_u, self.right + shift_u
        top, bottom = -(self.top + shift_v), -(self.bottom + shift_v)
        out = np.zeros((4, 4))
        out[0, 0] = 2.0 / (right - left)
        out[1, 1] = 2.0 / (top - bottom)
        out[0, 2] = (right + left) / (right - left)
        out[1, 2] = (top + bottom) / (top - bottom)
        out[2, 2] = -(far + near) / (far - near)
        out[2, 3] = -2.0 * far * near / (far - near)
        out[3, 2] = -1.0
        return [float(value) for value in out.T.flat]


def box_corners(boxes_m: FloatArray) -> FloatArray:
    """Return the corners (N, 8, 3) of axis-aligned boxes (N, 2, 3), low and high corner."""
    low, high = boxes_m[:, None, 0], boxes_m[:, None, 1]
    return np.asarray(low + _UNIT_CORNERS * (high - low))


def to_camera(view: RenderView, corners_odom_m: FloatArray) -> FloatArray:
    """Return corners (N, 8, 3) in the view's optical frame."""
    rotation, origin = view.T_odom_camera[:3, :3], view.T_odom_camera[:3, 3]
    flat = corners_odom_m.reshape(-1, 3) @ rotation - origin @ rotation
    return np.asarray(flat.reshape(corners_odom_m.shape))


def in_view(view: RenderView, corners_camera_m: FloatArray) -> NDArray[np.bool_]:
    """Return (N,) False for a box (N, 8, 3) that no sample of the image can fall on.

    It lies nearer or farther than everything drawn, or beyond one side plane of the frustum.
    """
    x, y, z = corners_camera_m[..., 0], corners_camera_m[..., 1], corners_camera_m[..., 2]
    slack = _SLACK_TANGENT * np.abs(z) + _SLACK_M
    return np.asarray(
        (z.max(axis=1) >= view.near_m - _SLACK_M)
        & (z.min(axis=1) <= view.far_m + _SLACK_M)
        & (x - view.left * z > -slack).any(axis=1)
        & (x - view.right * z < slack).any(axis=1)
        & (y - view.top * z > -slack).any(axis=1)
        & (y - view.bottom * z < slack).any(axis=1)
    )


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """The result of a backend: one row and column per sample of the view.

    Attributes:
        rgb: (h, w, 3) uint8; white where there is nothing.
        depth_m: (h, w) along the optical axis; infinite where there is nothing.
        body_ids: (h, w) int32, −1 where there is nothing.
    """

    rgb: NDArray[np.uint8]
    depth_m: FloatArray
    body_ids: NDArray[np.int32]


class RenderBackend(ABC):
    """A world of rigid bodies without physics, and the renderer that draws them.

    Bodies are numbered from 0 in the order in which they are added.
    """

    name: BackendName

    @abstractmethod
    def close(self) -> None:
        """End the world; a second call does nothing."""

    @abstractmethod
    def texture(self, rgb: NDArray[np.uint8]) -> int:
        """Register a texture (H, W, 3); return its number for :meth:`add_body`."""

    @abstractmethod
    def add_body(self, mesh: Mesh, colour: Colour, texture: int | None) -> int:
        """Make a body at the origin of odom; return its number. A texture needs the mesh's uv."""

    @abstractmethod
    def place(self, bodies: Sequence[int], T_odom_bodies: FloatArray) -> None:
        """Move bodies to their poses (N, 4, 4)."""

    @abstractmethod
    def hide(self, body: int) -> None:
        """Stop drawing a body, in every buffer."""

    @abstractmethod
    def reveal(self, body: int) -> None:
        """Draw a hidden body again."""

    @abstractmethod
    def draw(self, view: RenderView, light: Lighting) -> Drawing:
        """Draw the view as if the light were white and cast no shadows."""


def texture_key(rgb: NDArray[np.uint8]) -> bytes:
    """Return a hash of a texture's shape and texels."""
    return hashlib.blake2b(
        np.ascontiguousarray(rgb).data, digest_size=16, salt=str(rgb.shape).encode()[:16]
    ).digest()
