"""Racks, walls and other fixed boxes in the shapes that planners read.

Boxes are those of ``static_boxes_odom_m``: rows x_min, y_min, x_max, y_max in metres, along the
axes of odom. The forms are those of people, so a planner may join both::

    obstacles = np.vstack([circles(constraints), static_circles(boxes, 0.1)])
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import shapely
from shapely.geometry import Polygon

from perception.arrays import FloatArray, boxes_on_floor, finite_array, finite_number

from .._errors import NavError

# A smaller spacing or overshoot only costs memory.
_MINIMUM_M: Final = 1e-3


def static_points(boxes_odom_m: Any, spacing_m: float) -> FloatArray:
    """Return (M, 2) points on the outlines of all boxes, corners included.

    Neighbours along an outline are at most ``spacing_m`` apart, so no circle of a larger diameter
    passes between two of them.

    Args:
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max.
        spacing_m: ≥ 1 mm.

    Raises:
        NavError: for boxes that are not finite or not larger than a line, or for the spacing.
    """
    spacing = finite_number("spacing_m", spacing_m, NavError, minimum=_MINIMUM_M)
    rings: list[FloatArray] = [np.empty((0, 2))]
    for x_min, y_min, x_max, y_max in _checked_boxes(boxes_odom_m).tolist():
        corners = np.array([[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]])
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            steps = math.ceil(float(np.abs(end - start).max()) / spacing)
            rings.append(start + np.arange(steps)[:, None] / steps * (end - start))
    return np.concatenate(rings)


def static_polygons(boxes_odom_m: Any) -> tuple[Polygon, ...]:
    """Return each box (N, 4) as a shapely polygon with 4 corners, counter-clockwise.

    Raises:
        NavError: for boxes that are not finite or not larger than a line.
    """
    return tuple(shapely.box(*row) for row in _checked_boxes(boxes_odom_m).tolist())


def static_circles(boxes_odom_m: Any, overshoot_m: float) -> FloatArray:
    """Return (M, 5) circles x, y, vx, vy, radius that cover every box, with a velocity of 0.

    Every point of a box is in a circle, and no circle reaches farther than ``overshoot_m`` out of
    its box. A box whose circle would reach farther is halved along its longer side, again and
    again. So large circles fill the inside, and small ones line the edge. Their number grows with
    the outline of the box over the overshoot: a rack of 6 m × 1 m has 40 circles at 0.1 m.

    Args:
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max.
        overshoot_m: ≥ 1 mm.

    Raises:
        NavError: for boxes that are not finite or not larger than a line, or for the overshoot.
    """
    overshoot = finite_number("overshoot_m", overshoot_m, NavError, minimum=_MINIMUM_M)
    rows: list[tuple[float, float, float, float, float]] = []
    for box in _checked_boxes(boxes_odom_m).tolist():
        cells = [tuple(box)]
        while cells:
            x_min, y_min, x_max, y_max = cells.pop()
            x, y = 0.5 * (x_min + x_max), 0.5 * (y_min + y_max)
            radius = 0.5 * math.hypot(x_max - x_min, y_max - y_min)
            # A disc around a point of the box reaches out of it across the nearest edge.
            to_edge = min(x - box[0], box[2] - x, y - box[1], box[3] - y)
            if radius - to_edge <= overshoot:
                rows.append((x, y, 0.0, 0.0, radius))
            elif x_max - x_min >= y_max - y_min:
                cells += [(x, y_min, x_max, y_max), (x_min, y_min, x, y_max)]
            else:
                cells += [(x_min, y, x_max, y_max), (x_min, y_min, x_max, y)]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def static_half_planes(
    boxes_odom_m: Any,
    position_odom_m: Any,
    robot_radius_m: float,
    *,
    horizon_s: float = 3.0,
    resolve_s: float = 0.5,
) -> FloatArray:
    """Return (N, 3) rows nx, ny, b: a velocity v (m/s, odom) is allowed if nx·vx + ny·vy ≥ b.

    The form is that of :func:`half_planes`, one row for each box. The normal n leads from the
    nearest point of the box to the robot. The line through that point across n has the whole box
    on its other side, because a box is convex. So a disc-shaped robot that keeps an allowed
    velocity for ``horizon_s`` does not touch the box: it uses up the gap and no more,
    n·v ≥ −gap / horizon. The rule is cautious beside the end of a box, where ORCA allows more.

    If the disc overlaps the box, allowed velocities bring it out within ``resolve_s``, across the
    nearest edge.

    Args:
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max. Give the boxes near the robot: each one
            is a constraint.
        position_odom_m: (2,) the robot's centre.
        robot_radius_m: ≥ 0, of the disc around the robot.
        horizon_s: > 0, time within which no box may be touched.
        resolve_s: > 0, time for a robot that overlaps a box to get out.

    Raises:
        NavError: for an argument that is not finite or out of bounds.
    """
    boxes = _checked_boxes(boxes_odom_m)
    position = finite_array("position_odom_m", position_odom_m, (2,), NavError)
    robot_radius = finite_number("robot_radius_m", robot_radius_m, NavError, minimum=0.0)
    horizon, resolve = (
        finite_number(name, value, NavError, minimum=0.0, exclusive_minimum=True)
        for name, value in (("horizon_s", horizon_s), ("resolve_s", resolve_s))
    )
    low, high = boxes[:, :2], boxes[:, 2:]
    away = position - np.clip(position, low, high)
    distance = np.hypot(away[:, 0], away[:, 1])
    # Inside a box, or on its edge, the way out leads across the nearest edge.
    depths = np.hstack([position - low, high - position])
    edge = depths.argmin(axis=1)
    outwards = np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]])[edge]
    depth = np.take_along_axis(depths, edge[:, None], axis=1)[:, 0]
    outside = distance > 0.0
    normal = np.where(outside[:, None], away / np.where(outside, distance, 1.0)[:, None], outwards)
    gap = np.where(outside, distance, -depth) - robot_radius
    return np.column_stack([normal, -gap / np.where(gap >= 0.0, horizon, resolve)])


def _checked_boxes(boxes_odom_m: Any) -> FloatArray:
    return boxes_on_floor("boxes_odom_m", boxes_odom_m, NavError)
