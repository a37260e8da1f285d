"""A faster renderer: coarse scenery, with people at full resolution."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception import Camera
from perception.arrays import FloatArray, rigid_transform

from .._warehouse import Warehouse
from ..errors import SimError
from ._renderer import CameraRenderer, RenderedView

#: The least samples per metre on a person, if the camera has that many pixels.
FINE_PX_PER_M: Final = 240.0
# Width of the scenery around a person that is rendered as finely.
_PADDING_M: Final = 0.15
_NEAR_M: Final = 0.05
_UNIT_CORNERS: Final = np.array(
    [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.int64
)


class CoarseSceneryRenderer:
    """Renders like :class:`CameraRenderer`, but with one sample per block of pixels for scenery.

    The software renderer's time is proportional to the samples, and a wide image is mostly hall.
    The whole image is rendered coarsely and enlarged; then the rectangle of each person is rendered
    again with more samples. Depths and ids are enlarged by nearest neighbour, so each of them is
    one that was rendered.

    Args:
        warehouse: the warehouse to render.
        divisor: side of a block of scenery in pixels, ≥ 1; it must divide the image's width and
            height.
    """

    def __init__(self, warehouse: Warehouse, divisor: int) -> None:
        if divisor < 1:
            raise SimError(f"divisor must be a whole number from 1, got {divisor!r}")
        self._warehouse = warehouse
        self._divisor = divisor
        self._renderer = CameraRenderer(warehouse)

    def render(self, camera: Camera, T_odom_camera: Any) -> RenderedView:
        """Render the whole image.

        Raises:
            SimError: for a camera with distortion, and for a size that the divisor does not divide.
        """
        T = rigid_transform("T_odom_camera", T_odom_camera, SimError)
        size = (camera.width_px, camera.height_px)
        if any(length % self._divisor for length in size):
            raise SimError(
                f"blocks of {self._divisor} pixels must fill the image, got {size[0]} x {size[1]}"
            )
        coarse_size = (size[0] // self._divisor, size[1] // self._divisor)
        coarse = self._renderer.render(camera, T, size_px=coarse_size)
        if self._divisor == 1:
            return coarse
        view = _enlarged(coarse, self._divisor)
        people = [actor for actor in self._warehouse.visuals.actors if actor.kind == "person"]
        boxes = [_corners_camera_m(actor.bounds_odom_m(), T) for actor in people]
        # Nearer people are drawn later, so a coarser rectangle never covers a nearer person.
        for corners in sorted(boxes, key=lambda points: -float(points[:, 2].min())):
            self._refine(view, camera, T, corners)
        return view

    def _refine(
        self, view: RenderedView, camera: Camera, T_odom_camera: FloatArray, corners: FloatArray
    ) -> None:
        """Render the rectangle around a box's corners (8, 3), in the optical frame, more finely."""
        if corners[:, 2].max() <= _NEAR_M:
            return
        depth_m = max(float(corners[:, 2].min()), _NEAR_M)
        step = min(max(int(camera.fx_px / depth_m / FINE_PX_PER_M), 1), self._divisor)
        if step == self._divisor:
            return
        bounds = _rectangle(camera, corners)
        low = np.maximum(np.floor(bounds[:2] / step).astype(int), 0) * step
        size = (camera.width_px, camera.height_px)
        high = np.minimum(np.ceil(bounds[2:] / step).astype(int) * step, size)
        width, height = ((high - low) // step).tolist()
        if width < 1 or height < 1:
            return
        high = low + step * np.array([width, height])
        fine = self._renderer.render(camera, T_odom_camera, [*low, *high], (width, height))
        part = _enlarged(fine, step)
        rows, columns = slice(low[1], high[1]), slice(low[0], high[0])
        view.rgb[rows, columns] = part.rgb
        view.depth_m[rows, columns] = part.depth_m
        view.body_ids[rows, columns] = part.body_ids
        view.actors[rows, columns] = part.actors


def _enlarged(view: RenderedView, factor: int) -> RenderedView:
    """Return the view at ``factor`` times the size: colours bilinear, everything else nearest."""
    height, width = view.actors.shape
    size = (factor * width, factor * height)

    def nearest(values: NDArray[Any]) -> Any:
        # The same as OpenCV's exact nearest neighbour, and faster on one core.
        return np.repeat(np.repeat(values, factor, axis=1), factor, axis=0)

    return RenderedView(
        np.asarray(cv2.resize(view.rgb, size, interpolation=cv2.INTER_LINEAR), dtype=np.uint8),
        nearest(view.depth_m),
        nearest(view.body_ids),
        nearest(view.actors),
    )


def _corners_camera_m(bounds_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
    """Return the corners (8, 3) of an upright box (2, 3) with padding, in the optical frame."""
    low, high = bounds_odom_m[0] - _PADDING_M, bounds_odom_m[1] + _PADDING_M
    corners = np.where(_UNIT_CORNERS == 1, high, low)
    return np.asarray((corners - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3])


def _rectangle(camera: Camera, corners: FloatArray) -> FloatArray:
    """Return the rectangle (4,) around the corners, in pixels from the image's corner.

    It is the whole image if a corner lies beside or behind the camera.
    """
    if corners[:, 2].min() <= _NEAR_M:
        return np.array([0.0, 0.0, camera.width_px, camera.height_px])
    # The image's corner lies half a pixel before the centre of pixel 0.
    pixels = camera.project(corners) + 0.5
    return np.concatenate([pixels.min(axis=0), pixels.max(axis=0)])
