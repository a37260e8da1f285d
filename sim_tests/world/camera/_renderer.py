"""The camera renderer: images, depth and ids, exact to the camera model's pixel convention.

A faster renderer draws coarse scenery, with people at full resolution.

Shadows of actors on the floor are drawn as well. PyBullet's own shadows do not work in a hall: the
ceiling shades everything, and the shadow map covers a few metres around the origin at the image's
resolution, which stripes even a flat floor. Here every actor is drawn once as the lamp sees it. A
floor pixel lies in shadow if its ray to the lamp meets that outline, so shadows do not depend on
the renderer or on the rectangle rendered.
"""

from __future__ import annotations

import math
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception import Camera
from perception.arrays import FloatArray, rigid_transform

from .._warehouse import Warehouse
from ..errors import SimError
from ..hall import Lighting
from ..render import Drawing, RenderView, Visuals, box_corners, in_view, to_camera

# Distance of the lamp; its rays are then parallel to within one sample of the outline.
_LAMP_M: Final = 400.0
# Spacing of an outline's samples on the actor, the most samples along a side, and the margin.
_GRID_M: Final = 0.02
_MAX_SAMPLES: Final = 192
_MARGIN_SAMPLES: Final = 6
# Blur of the outline (standard deviation), since the lamps of a hall are wide.
_SOFT_M: Final = 0.04
# Surfaces at most this far from z = 0 are floor, such as markings.
_FLOOR_M: Final = 0.03
# Below this sine of the lamp's elevation, shadows would not end in the hall: none are cast.
_MIN_ELEVATION_SINE: Final = 0.2


def shade_floor(visuals: Visuals, view: RenderView, drawing: Drawing, light: Lighting) -> None:
    """Darken the floor of a drawing in place where an actor stands between it and the lamp.

    It leaves the render world unprepared: call ``Visuals.prepare`` before the next image.
    """
    towards = np.asarray(light.direction_odom, dtype=np.float64)
    towards = towards / float(np.linalg.norm(towards))
    if towards[2] < _MIN_ELEVATION_SINE or not visuals.actors:
        return
    bounds = np.array([actor.bounds_odom_m() for actor in visuals.actors], dtype=np.float64)
    corners = box_corners(bounds)
    shadows = corners - towards * (np.maximum(corners[..., 2:], 0.0) / towards[2])
    on_floor = np.stack([shadows.min(axis=1), shadows.max(axis=1)], axis=1)
    on_floor[:, :, 2] = -_FLOOR_M, _FLOOR_M
    visible = in_view(view, to_camera(view, box_corners(on_floor)))
    visible &= corners[..., 2].max(axis=1) > 0.0
    if not visible.any():
        return
    scenery = (drawing.body_ids >= 0) & (visuals.actor_numbers(drawing.body_ids) < 0)
    rows, columns, points = _floor_points(view, drawing.depth_m, scenery)
    # The share of the light that the floor gets from the lamp; the floor's normal is odom z.
    lamp_share = light.diffuse * towards[2] / (light.ambient + light.diffuse * towards[2])
    brightness = np.ones(len(points))
    for number in np.flatnonzero(visible).tolist():
        low, high = on_floor[number]
        soft = 3.0 * _SOFT_M
        near = np.flatnonzero(
            (points[:, :2] > low[:2] - soft).all(axis=1)
            & (points[:, :2] < high[:2] + soft).all(axis=1)
        )
        if len(near):
            shade = _shade(visuals, number, corners[number], towards, points[near], view.far_m)
            brightness[near] *= 1.0 - lamp_share * shade
    shaded = np.flatnonzero(brightness < 1.0)
    rows, columns = rows[shaded], columns[shaded]
    drawing.rgb[rows, columns] = np.rint(drawing.rgb[rows, columns] * brightness[shaded, None])


def _floor_points(
    view: RenderView, depth_m: FloatArray, scenery: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Return rows, columns and odom points (N, 3) of the samples that show the floor."""
    rotation, origin = view.T_odom_camera[:3, :3], view.T_odom_camera[:3, 3]
    step_u = (view.right - view.left) / view.width
    step_v = (view.bottom - view.top) / view.height
    u = view.left + (np.arange(view.width) + 0.5) * step_u
    v = view.top + (np.arange(view.height) + 0.5) * step_v
    rise = rotation[2, 0] * u[None, :] + rotation[2, 1] * v[:, None] + rotation[2, 2]
    with np.errstate(invalid="ignore"):  # depth is infinite where there is nothing
        height = origin[2] + depth_m * rise
        floor = (np.abs(height) < _FLOOR_M) & scenery
    rows, columns = np.nonzero(floor)
    rays = np.stack([u[columns], v[rows], np.ones(len(rows))], axis=1)
    return rows, columns, origin + (rays * depth_m[rows, columns, None]) @ rotation.T


def _shade(
    visuals: Visuals,
    number: int,
    corners_odom_m: FloatArray,
    towards: FloatArray,
    points_odom_m: FloatArray,
    far_m: float,
) -> FloatArray:
    """Return (N,) the actor's shadow on each floor point: 0 is none, 1 is full."""
    outline_view = _lamp_view(corners_odom_m, towards, far_m)
    visuals.prepare(outline_view, {number})
    drawing = visuals.draw(outline_view, Lighting())
    outline = (visuals.actor_numbers(drawing.body_ids) == number).astype(np.float32)
    grid_m = (outline_view.right - outline_view.left) * _LAMP_M / outline_view.width
    outline = np.asarray(cv2.GaussianBlur(outline, (0, 0), max(_SOFT_M / grid_m, 0.3)))
    T = outline_view.T_odom_camera
    points_lamp_m = (points_odom_m - T[:3, 3]) @ T[:3, :3]
    depth_m = points_lamp_m[:, 2]
    across = (points_lamp_m[:, 0] / depth_m - outline_view.left) * (_LAMP_M / grid_m)
    down = (points_lamp_m[:, 1] / depth_m - outline_view.top) * (_LAMP_M / grid_m)
    column, row = np.floor(across).astype(int), np.floor(down).astype(int)
    inside = (column >= 0) & (column < outline_view.width)
    inside &= (row >= 0) & (row < outline_view.height)
    out = np.zeros(len(points_odom_m))
    out[inside] = outline[row[inside], column[inside]]
    return out


def _lamp_view(corners_odom_m: FloatArray, towards: FloatArray, far_m: float) -> RenderView:
    """Return the view of an actor's box from the lamp, with a margin, on a square grid."""
    side = np.array([1.0, 0.0, 0.0]) if abs(towards[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    down = np.cross(-towards, side)
    down /= np.linalg.norm(down)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([np.cross(down, -towards), down, -towards])
    T[:3, 3] = corners_odom_m.mean(axis=0) + towards * _LAMP_M
    corners_lamp_m = (corners_odom_m - T[:3, 3]) @ T[:3, :3]
    tangents = corners_lamp_m[:, :2] / corners_lamp_m[:, 2:]
    low, high = tangents.min(axis=0), tangents.max(axis=0)
    longest = float((high - low).max())
    step = max(longest / _MAX_SAMPLES, _GRID_M / _LAMP_M)
    width, height = (
        math.ceil(extent / step) + 2 * _MARGIN_SAMPLES for extent in (high - low).tolist()
    )
    left, top = (low - _MARGIN_SAMPLES * step).tolist()
    reach = far_m + float(np.ptp(corners_lamp_m[:, 2]))
    return RenderView(
        T,
        left=left,
        right=left + width * step,
        top=top,
        bottom=top + height * step,
        width=width,
        height=height,
        near_m=float(corners_lamp_m[:, 2].min()) - 1.0,
        far_m=_LAMP_M + reach,
    )


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
            drawing = self._draw(view, only)
            rgb = drawing.rgb
        else:
            fine = self._draw(view.finer(factor), only)
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

    def _draw(self, view: RenderView, only: AbstractSet[int] | None) -> Drawing:
        visuals = self._warehouse.visuals
        visuals.prepare(view, only)
        drawing = visuals.draw(view, self._light)
        if self._light.shadows and only is None:
            shade_floor(visuals, view, drawing, self._light)
        return drawing


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
