"""Obstacles in the shapes that planners read: circles, points, polygons, boxes.

Pure functions of the constraints; everything is in the odom frame, one entry a person, in the order
of ``constraints.obstacles``, and an empty array or tuple when there is nobody.

A policy may stretch an obstacle along the person's way. Shapes without a velocity are stretched
with it. Circles are not: who reads them moves them along the velocity.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import Polygon

from perception.arrays import FloatArray, finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from ._outlines import long_outlines

# A finer perimeter than this only costs memory.
_MINIMUM_SPACING_M = 1e-3
_MINIMUM_POINTS = 8


def circles(constraints: NavConstraints) -> FloatArray:
    """(N, 5) x, y (m), vx, vy (m/s) and radius (m): for velocity obstacles, MPC, TEB."""
    rows = [
        [*o.center_odom_m.tolist(), *o.velocity_odom_mps.tolist(), o.radius_m]
        for o in constraints.obstacles
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def points(constraints: NavConstraints, spacing_m: float) -> FloatArray:
    """(M, 2) points on the obstacles' outlines, for planners that read a laser scan or a cloud.

    Neighbours along an outline, the last and the first included, lie at most ``spacing_m`` apart;
    every outline has at least 8 points.

    Raises:
        NavError: ``spacing_m`` is not finite or below 1 mm.
    """
    spacing = finite_number("spacing_m", spacing_m, NavError, minimum=_MINIMUM_SPACING_M)
    rings: list[FloatArray] = [np.empty((0, 2))]
    outlines = long_outlines(constraints)
    for index, obstacle in enumerate(constraints.obstacles):
        if index in outlines:
            ring = shapely.linearrings(outlines[index])
            step = min(spacing, shapely.length(ring) / _MINIMUM_POINTS)
            rings.append(shapely.get_coordinates(shapely.segmentize(ring, step))[:-1])
            continue
        # The arc is longer than the chord between neighbours, so this errs to the dense side.
        count = max(_MINIMUM_POINTS, math.ceil(2.0 * math.pi * obstacle.radius_m / spacing))
        angle = np.arange(count) * (2.0 * math.pi / count)
        directions = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        rings.append(obstacle.center_odom_m + obstacle.radius_m * directions)
    return np.concatenate(rings)


def polygons(constraints: NavConstraints) -> tuple[Polygon, ...]:
    """Shapely polygons, each containing its obstacle's circle."""
    return tuple(obstacle.polygon for obstacle in constraints.obstacles)


def boxes(constraints: NavConstraints) -> FloatArray:
    """(N, 7) upright 3-D boxes: centre x, y, z, size x, y, z (m) and yaw (rad).

    Each is the box about the obstacle's outline, standing on the floor (z = 0) and turned with the
    person's velocity (yaw 0 for one who stands). Size x runs along the yaw direction.
    """
    outlines = long_outlines(constraints)
    rows = []
    for index, obstacle in enumerate(constraints.obstacles):
        (x, y), (vx, vy) = obstacle.center_odom_m, obstacle.velocity_odom_mps
        length = width = 2.0 * obstacle.radius_m
        yaw, height = math.atan2(vy, vx), obstacle.height_m
        if index in outlines:
            c, s = math.cos(yaw), math.sin(yaw)
            turned = outlines[index] @ np.array([[c, -s], [s, c]])
            low, high = turned.min(axis=0), turned.max(axis=0)
            length, width = high - low
            x, y = np.array([[c, -s], [s, c]]) @ (0.5 * (low + high))
        rows.append([x, y, 0.5 * height, length, width, height, yaw])
    return np.array(rows, dtype=np.float64).reshape(-1, 7)
