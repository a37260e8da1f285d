"""Shadows of actors (people, robots, props that move) on the floor.

PyBullet's own shadows do not work in a hall: the ceiling shades everything, and the shadow map
covers a few metres around the origin at the image's resolution, which stripes even a flat floor.
Here every actor is drawn once as the lamp sees it. A floor pixel lies in shadow if its ray to the
lamp meets that outline, so shadows do not depend on the renderer or on the rectangle rendered.
"""

from __future__ import annotations

import math
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

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
