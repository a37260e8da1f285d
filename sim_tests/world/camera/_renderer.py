"""The camera renderer: images, depth and ids, exact to the camera model's pixel convention."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception import Camera
from perception.arrays import FloatArray

from .._warehouse import Warehouse
from ..errors import SimError
from ..hall import Lighting
from ..render import Drawing, RenderView
from ._floor_shadows import shade_floor

_MAX_SUPERSAMPLING: Final = 8


@dataclass(frozen=True, slots=True, eq=False)
class RenderedView:
    """A rendered image with the depth and the ids of each pixel; row v, column u.

    Attributes:
        rgb: (h, w, 3) uint8.
        depth_m: (h, w) distance along the optical axis z; infinite where there is nothing.
        body_ids: (h, w) int32, PyBullet's id of the body in the render world, −1 where there is
            nothing.
        actors: (h, w) int32, number of the actor (:meth:`Visuals.add_actor`), −1 for scenery and
            where there is nothing.
    """

    rgb: NDArray[np.uint8]
    depth_m: FloatArray
    body_ids: NDArray[np.int32]
    actors: NDArray[np.int32]


class CameraRenderer:
    """Renders a warehouse as an undistorted camera sees it.

    A pixel is sampled at its centre, which :meth:`perception.Camera.project` puts at integer
    coordinates as OpenCV does. Truth projected through the camera therefore falls on the image.

    Args:
        warehouse: the warehouse to render.
        lighting: the hall's lighting; None is ``bright_led``.
        shadows: whether actors cast shadows on the floor; None is the lighting's own setting.
        supersampling: n averages n × n samples per pixel, 1 to 8. Depth and ids are never
            averaged. They come from one sample: at the pixel's centre for an odd n, half a sample
            right of and below it for an even n.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        *,
        lighting: Lighting | None = None,
        shadows: bool | None = None,
        supersampling: int = 1,
    ) -> None:
        self._warehouse = warehouse
        light = Lighting() if lighting is None else lighting
        self._light = light if shadows is None else light.model_copy(update={"shadows": shadows})
        # The renderers colour one of the two lights at most, so the image is tinted instead.
        levels = np.arange(256)[:, None] * np.asarray(light.colour_rgb)
        self._tint = (
            None if light.colour_rgb == (1.0, 1.0, 1.0) else np.rint(levels).astype(np.uint8)[None]
        )
        if supersampling not in range(1, _MAX_SUPERSAMPLING + 1):
            raise SimError(
                f"supersampling must be a whole number from 1 to {_MAX_SUPERSAMPLING}, "
                f"got {supersampling!r}"
            )
        self._supersampling = int(supersampling)

    def rgb(self, camera: Camera, T_odom_camera: Any) -> NDArray[np.uint8]:
        """Return the camera's image (H, W, 3)."""
        return self.render(camera, T_odom_camera).rgb

    def depth(
        self,
        camera: Camera,
        T_odom_camera: Any,
        roi_xyxy_px: Any = None,
        size_px: tuple[int, int] | None = None,
    ) -> FloatArray:
        """Return the depth (h, w) along the optical axis; arguments as in :meth:`render`."""
        view = RenderView.of_rectangle(camera, T_odom_camera, roi_xyxy_px, size_px)
        return self._draw(view, None).depth_m

    def render(
        self,
        camera: Camera,
        T_odom_camera: Any,
        roi_xyxy_px: Any = None,
        size_px: tuple[int, int] | None = None,
        only: AbstractSet[int] | None = None,
    ) -> RenderedView:
        """Render the whole image or a rectangle of it.

        Args:
            camera: without distortion.
            T_odom_camera: (4, 4), optical frame to odom.
            roi_xyxy_px: (4,) u_min, v_min, u_max, v_max in pixels from the image's corner, the
                maxima exclusive as in ``image[v_min:v_max, u_min:u_max]``; it may reach outside
                the image. None is the whole image.
            size_px: width and height of the result; None is one sample per pixel of the
                rectangle, and the result then equals that part of the whole image.
            only: numbers of the actors to draw, without scenery, for their silhouettes; None
                draws everything.

        Raises:
            SimError: for a camera with distortion, an empty rectangle or a size below one pixel.
        """
        view = RenderView.of_rectangle(camera, T_odom_camera, roi_xyxy_px, size_px)
        factor = self._supersampling
        if factor == 1:
            drawing = self._draw(view, only, shadows=self._light.shadows)
            rgb = drawing.rgb
        else:
            fine = self._draw(view.finer(factor), only, shadows=self._light.shadows)
            rgb = np.asarray(
                cv2.resize(fine.rgb, (view.width, view.height), interpolation=cv2.INTER_AREA),
                dtype=np.uint8,
            )
            middle = slice(factor // 2, None, factor)
            drawing = Drawing(
                rgb,
                np.ascontiguousarray(fine.depth_m[middle, middle]),
                np.ascontiguousarray(fine.body_ids[middle, middle]),
            )
        if self._tint is not None:
            rgb = np.asarray(cv2.LUT(rgb, self._tint), dtype=np.uint8)
        actors = self._warehouse.visuals.actor_numbers(drawing.body_ids)
        return RenderedView(rgb, drawing.depth_m, drawing.body_ids, actors)

    def _draw(
        self, view: RenderView, only: AbstractSet[int] | None, *, shadows: bool = False
    ) -> Drawing:
        visuals = self._warehouse.visuals
        visuals.prepare(view, only)
        drawing = visuals.draw(view, self._light)
        if shadows and only is None:
            shade_floor(visuals, view, drawing, self._light)
        return drawing
