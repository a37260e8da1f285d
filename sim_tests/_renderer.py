"""Pictures and depth of the simulated hall, exact to the pixel convention of the camera model."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception import Camera
from perception.arrays import FloatArray, finite_array, finite_number, rigid_transform

from ._bullet import pybullet
from ._errors import SimError
from ._warehouse import Warehouse

# OpenGL looks along −z with y up, the optical frame along +z with y down.
_OPTICAL_TO_OPENGL: Final = np.diag([1.0, -1.0, -1.0, 1.0])
# Half a metre behind the far plane counts as nothing: float32 depth is coarse out there.
_FAR_MARGIN_M: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class RenderedView:
    """One rendered view; row v, column u.

    Attributes:
        rgb: (h, w, 3) uint8.
        depth_m: (h, w) distance along the optical axis z; infinite where there is nothing.
        body_ids: (h, w) PyBullet's body id seen in the pixel, −1 where there is nothing.
    """

    rgb: NDArray[np.uint8]
    depth_m: FloatArray
    body_ids: NDArray[np.int32]


class CameraRenderer:
    """Renders what an undistorted camera sees, with PyBullet's software renderer.

    A pixel's sample lies where :meth:`perception.Camera.project` puts that pixel's centre (integer
    coordinates, as in OpenCV), so truth projected through the camera falls on the picture.

    Args:
        warehouse: what is rendered.
        shadows: cast shadows; about twice the time.
        near_m: nothing closer is drawn, > 0.
        far_m: nothing farther is drawn, > near_m.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        *,
        shadows: bool = False,
        near_m: float = 0.05,
        far_m: float = 60.0,
    ) -> None:
        self._warehouse = warehouse
        self._shadows = bool(shadows)
        self._near_m = finite_number(
            "near_m", near_m, SimError, minimum=0.0, exclusive_minimum=True
        )
        self._far_m = finite_number(
            "far_m", far_m, SimError, minimum=self._near_m, exclusive_minimum=True
        )

    def rgb(self, camera: Camera, T_odom_camera: Any) -> NDArray[np.uint8]:
        """The camera's picture (H, W, 3)."""
        return self.render(camera, T_odom_camera).rgb

    def depth(
        self,
        camera: Camera,
        T_odom_camera: Any,
        roi_xyxy_px: Any = None,
        size_px: tuple[int, int] | None = None,
    ) -> FloatArray:
        """Depth (h, w) in metres along the optical axis; arguments as in :meth:`render`."""
        return self.render(camera, T_odom_camera, roi_xyxy_px, size_px).depth_m

    def render(
        self,
        camera: Camera,
        T_odom_camera: Any,
        roi_xyxy_px: Any = None,
        size_px: tuple[int, int] | None = None,
    ) -> RenderedView:
        """Render the whole image or a rectangle of it.

        Args:
            camera: without distortion.
            T_odom_camera: (4, 4), optical frame to odom.
            roi_xyxy_px: (4,) u_min, v_min, u_max, v_max in pixels counted from the image's corner,
                the maxima exclusive as in ``image[v_min:v_max, u_min:u_max]``; it may reach outside
                the image. None is the whole image.
            size_px: width and height of the result; None is one sample a pixel of the rectangle,
                and then the result equals that part of the whole image.

        Raises:
            SimError: for a camera with distortion, an empty rectangle or a size below one pixel.
        """
        if camera.distortion is not None:
            raise SimError(
                "the renderer makes undistorted pictures; use a camera with distortion=None"
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
        projection = self._projection(camera, (u_min, v_min, u_max, v_max), (width, height))
        _, _, rgba, depth, bodies = pybullet.getCameraImage(
            width,
            height,
            (_OPTICAL_TO_OPENGL @ np.linalg.inv(T)).T.ravel().tolist(),
            projection.T.ravel().tolist(),
            # High and off to one side: faces and folds of cloth keep their shape.
            lightDirection=[-3.0, 4.0, 8.0],
            lightColor=[1.0, 1.0, 1.0],
            lightDistance=12.0,
            lightAmbientCoeff=0.66,
            lightDiffuseCoeff=0.40,
            lightSpecularCoeff=0.0,
            shadow=int(self._shadows),
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._warehouse.client,
        )
        near, far = self._near_m, self._far_m
        buffer = np.asarray(depth, dtype=np.float64).reshape(height, width)
        depth_m = far * near / (far - (far - near) * buffer)
        depth_m[depth_m > far - _FAR_MARGIN_M] = np.inf
        return RenderedView(
            rgb=np.ascontiguousarray(
                np.asarray(rgba, dtype=np.uint8).reshape(height, width, 4)[..., :3]
            ),
            depth_m=depth_m,
            body_ids=np.asarray(bodies, dtype=np.int32).reshape(height, width),
        )

    def _projection(
        self,
        camera: Camera,
        rectangle_px: tuple[float, float, float, float],
        size_px: tuple[int, int],
    ) -> FloatArray:
        """OpenGL projection (4, 4) of an asymmetric frustum for exactly this pixel grid.

        The software renderer samples column i at the fraction i / width of the frustum and, as it
        flips the image, row j at (j + 1) / height from the top; the frustum is placed so that those
        samples are the pixels' centres.
        """
        u_min, v_min, u_max, v_max = rectangle_px
        step_u, step_v = (u_max - u_min) / size_px[0], (v_max - v_min) / size_px[1]
        first_u = u_min - 0.5 + 0.5 * step_u  # a rectangle's corner lies half a pixel before its
        first_v = v_min - 0.5 + 0.5 * step_v  # first centre
        left = (first_u - camera.cx_px) / camera.fx_px
        right = (first_u + (u_max - u_min) - camera.cx_px) / camera.fx_px
        top = -(first_v - step_v - camera.cy_px) / camera.fy_px
        bottom = -(first_v - step_v + (v_max - v_min) - camera.cy_px) / camera.fy_px
        near, far = self._near_m, self._far_m
        projection = np.zeros((4, 4))
        projection[0, 0] = 2.0 / (right - left)
        projection[1, 1] = 2.0 / (top - bottom)
        projection[0, 2] = (right + left) / (right - left)
        projection[1, 2] = (top + bottom) / (top - bottom)
        projection[2, 2] = -(far + near) / (far - near)
        projection[2, 3] = -2.0 * far * near / (far - near)
        projection[3, 2] = -1.0
        return projection
