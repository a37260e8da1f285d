"""Gaps between a moving rectangle and discs, strips and boxes, for many poses at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from perception.arrays import FloatArray

from ._planner_rollout import Poses


class Rectangles(NamedTuple):
    """Rectangles of the same width at many poses.

    Attributes:
        centers: poses of the centres, heading along the length.
        half_length_m: one number, or one a pose.
        half_width_m: one number.
    """

    centers: Poses
    half_length_m: FloatArray | float
    half_width_m: float


def disc_gap_m(
    rectangles: Rectangles,
    x_m: FloatArray,
    y_m: FloatArray,
    radius_m: FloatArray,
) -> FloatArray:
    """Distance from rectangles to discs; negative where they overlap.

    Exact while the disc's centre is outside the rectangle; inside, minus the radius.

    Args:
        rectangles: the first shape.
        x_m: disc centres in the frame of the rectangles, broadcast against their poses.
        y_m: the same along y.
        radius_m: of the discs.
    """
    centers, half_length, half_width = rectangles
    c, s = centers.cos_heading, centers.sin_heading
    rel_x, rel_y = centers.x_m - x_m, centers.y_m - y_m
    along = np.maximum(np.abs(rel_x * c + rel_y * s) - half_length, 0.0)
    across = np.maximum(np.abs(rel_y * c - rel_x * s) - half_width, 0.0)
    return np.asarray(np.sqrt(along * along + across * across) - radius_m)


def strip_distance_m(
    rel_x_m: FloatArray,
    rel_y_m: FloatArray,
    velocity_x_mps: FloatArray,
    velocity_y_mps: FloatArray,
    ahead_s: float,
) -> FloatArray:
    """Distance from points to the segments that walkers cover in the next ``ahead_s``.

    ``rel_x_m`` and ``rel_y_m`` are point minus walker. For someone who stands it is the distance
    to that person.
    """
    speed2 = velocity_x_mps * velocity_x_mps + velocity_y_mps * velocity_y_mps
    inverse = 1.0 / np.maximum(speed2, 1e-12)
    along_s = rel_x_m * (velocity_x_mps * inverse) + rel_y_m * (velocity_y_mps * inverse)
    along_s = np.minimum(np.maximum(along_s, 0.0), ahead_s)
    off_x = rel_x_m - velocity_x_mps * along_s
    off_y = rel_y_m - velocity_y_mps * along_s
    return np.asarray(np.sqrt(off_x * off_x + off_y * off_y))


def box_gap_m(rectangles: Rectangles, boxes_m: FloatArray) -> FloatArray:
    """Lower bound of the distance from rectangles to the nearest axis-aligned box.

    A rectangle counts with its axis-aligned bounding box, and a diagonal gap with its larger
    component: exact along a wall, smaller than the distance past a corner, never larger. Negative
    where the bounding box overlaps a box; infinite without boxes.

    Args:
        rectangles: in the frame of the boxes.
        boxes_m: (N, 4) x_min, y_min, x_max, y_max.
    """
    centers, half_length, half_width = rectangles
    cos_abs, sin_abs = np.abs(centers.cos_heading), np.abs(centers.sin_heading)
    extent_x = half_length * cos_abs + half_width * sin_abs
    extent_y = half_length * sin_abs + half_width * cos_abs
    x_low, x_high = centers.x_m - extent_x, centers.x_m + extent_x
    y_low, y_high = centers.y_m - extent_y, centers.y_m + extent_y
    nearest = np.full(np.shape(x_low), np.inf)
    for x_min, y_min, x_max, y_max in boxes_m.tolist():
        gap_x = np.maximum(x_min - x_high, x_low - x_max)
        gap_y = np.maximum(y_min - y_high, y_low - y_max)
        nearest = np.minimum(nearest, np.maximum(gap_x, gap_y))
    return nearest
