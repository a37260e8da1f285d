"""Shadows that people, robots and props cast on the floor.

PyBullet's own shadows are of no use in a hall: the ceiling shades everything, the map covers a few
metres around the origin and its resolution is the picture's, so that even floors are striped. Here
every actor is drawn once as the lamp sees it, and a floor pixel whose ray to the lamp meets that
outline lies in shadow. That depends neither on the rectangle rendered nor on the renderer.
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

# From here the lamp's rays are parallel to within the grid of the outline.
_LAMP_M: Final = 400.0
_GRID_M: Final = 0.02
_MOST_SAMPLES: Final = 192
# Lamps in a hall are wide: the outline is soft by about this much (standard deviation).
_SOFT_M: Final = 0.04
_MARGIN_SAMPLES: Final = 6
# Paint and worn concrete lie within this much of z = 0.
_FLOOR_M: Final = 0.03
# A lamp lower than this (sine of its elevation) casts no shadow that ends in the hall.
_LOWEST: Final = 0.2


def shade_floor(visuals: Visuals, view: RenderView, drawing: Drawing, light: Lighting) -> None:
    """Darken the floor of a drawing in place where an actor stands between it and the lamp.

    The world must be prepared again before the next picture.
    """
    towards = np.asarray(light.direction_odom, dtype=np.float64)
    towards = towards / float(np.linalg.norm(towards))
    if towards[2] < _LOWEST or not visuals.actors:
        return
    bounds = np.array([actor.bounds_odom_m() for actor in visuals.actors], dtype=np.float64)
    corners = box_corners(bounds)
    cast = corners - towards * (np.maximum(corners[..., 2:], 0.0) / towards[2])
    on_floor = np.stack([cast.min(axis=1), cast.max(axis=1)], axis=1)
    on_floor[:, :, 2] = -_FLOOR_M, _FLOOR_M
    falls_in = in_view(view, to_camera(view, box_corners(on_floor)))
    falls_in &= corners[..., 2].max(axis=1) > 0.0
    if not falls_in.any():
        return
    scenery = (drawing.body_ids >= 0) & (visuals.actor_numbers(drawing.body_ids) < 0)
    rows, columns, points = _floor_points(view, drawing.depth_m, scenery)
    # What the floor loses where the lamp does not reach it: its normal is odom z.
    lamp_share = light.diffuse * towards[2] / (light.ambient + light.diffuse * towards[2])
    left = np.ones(len(points))
    for number in np.flatnonzero(falls_in).tolist():
        low, high = on_floor[number]
        soft = 3.0 * _SOFT_M
        near = np.flatnonzero(
            (points[:, :2] > low[:2] - soft).all(axis=1)
            & (points[:, :2] < high[:2] + soft).all(axis=1)
        )
        if len(near):
            shade = _shade(visuals, number, corners[number], towards, points[near], view.far_m)
            left[near] *= 1.0 - lamp_share * shade
    shaded = np.flatnonzero(left < 1.0)
    rows, columns = rows[shaded], columns[shaded]
    drawing.rgb[rows, columns] = np.rint(drawing.rgb[rows, columns] * left[shaded, None])


def _floor_points(
    view: RenderView, depth_m: FloatArray, scenery: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Rows, columns and places (N, 3) in odom of the samples that show the floor."""
    rotation, origin = view.T_odom_camera[:3, :3], view.T_odom_camera[:3, 3]
    step_u = (view.right - view.left) / view.width
    step_v = (view.bottom - view.top) / view.height
    u = view.left + (np.arange(view.width) + 0.5) * step_u
    v = view.top + (np.arange(view.height) + 0.5) * step_v
    rise = rotation[2, 0] * u[None, :] + rotation[2, 1] * v[:, None] + rotation[2, 2]
    with np.errstate(invalid="ignore"):  # where there is nothing, depth is infinite
        height = origin[2] + depth_m * rise
        seen = (np.abs(height) < _FLOOR_M) & scenery
    rows, columns = np.nonzero(seen)
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
    """(N,) how far each point lies in the actor's shadow, 0 to 1."""
    outline_view = _lamp_view(corners_odom_m, towards, far_m)
    least_depth_m = visuals.prepare(outline_view, {number})
    drawing = visuals.draw(outline_view, Lighting(), least_depth_m)
    outline = (visuals.actor_numbers(drawing.body_ids) == number).astype(np.float32)
    grid_m = (outline_view.right - outline_view.left) * _LAMP_M / outline_view.width
    outline = np.asarray(cv2.GaussianBlur(outline, (0, 0), max(_SOFT_M / grid_m, 0.3)))
    T = outline_view.T_odom_camera
    seen = (points_odom_m - T[:3, 3]) @ T[:3, :3]
    across = (seen[:, 0] / seen[:, 2] - outline_view.left) * (_LAMP_M / grid_m)
    down = (seen[:, 1] / seen[:, 2] - outline_view.top) * (_LAMP_M / grid_m)
    column, row = np.floor(across).astype(int), np.floor(down).astype(int)
    inside = (column >= 0) & (column < outline_view.width)
    inside &= (row >= 0) & (row < outline_view.height)
    out = np.zeros(len(points_odom_m))
    out[inside] = outline[row[inside], column[inside]]
    return out


def _lamp_view(corners_odom_m: FloatArray, towards: FloatArray, far_m: float) -> RenderView:
    """The actor's box as a lamp sees it from far away, with a margin, on a square grid."""
    side = np.array([1.0, 0.0, 0.0]) if abs(towards[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    down = np.cross(-towards, side)
    down /= np.linalg.norm(down)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([np.cross(down, -towards), down, -towards])
    T[:3, 3] = corners_odom_m.mean(axis=0) + towards * _LAMP_M
    seen = (corners_odom_m - T[:3, 3]) @ T[:3, :3]
    tangents = seen[:, :2] / seen[:, 2:]
    low, high = tangents.min(axis=0), tangents.max(axis=0)
    longest = float((high - low).max())
    step = max(longest / _MOST_SAMPLES, _GRID_M / _LAMP_M)
    width, height = (
        math.ceil(extent / step) + 2 * _MARGIN_SAMPLES for extent in (high - low).tolist()
    )
    left, top = (low - _MARGIN_SAMPLES * step).tolist()
    reach = far_m + float(np.ptp(seen[:, 2]))
    return RenderView(
        T,
        left=left,
        right=left + width * step,
        top=top,
        bottom=top + height * step,
        width=width,
        height=height,
        near_m=float(seen[:, 2].min()) - 1.0,
        far_m=_LAMP_M + reach,
    )
