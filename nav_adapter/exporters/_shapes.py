"""Obstacles in the shapes that planners read: circles, points, polygons, boxes.

Pure functions of the constraints, in the odom frame. They have one entry per person, in the order
of ``constraints.obstacles``, and return an empty array or tuple without people.

A policy may stretch an obstacle along the person's motion. Shapes without a velocity are stretched
with it. Circles are not: planners that use them move them along the velocity.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import shapely
from shapely.geometry import Polygon

from perception.arrays import FloatArray, finite_number

from .._constraints import NavConstraints
from .._errors import NavError

# A smaller spacing only costs memory.
_MINIMUM_SPACING_M: Final = 1e-3
_MINIMUM_POINTS: Final = 8
# The 24-sided polygon of a circle is 0.6 % larger than the circle. A polygon larger by 2 % or more
# is longer than the circle by a fiftieth of the radius or more.
_STRETCHED_AREA_RATIO: Final = 1.02


def circles(constraints: NavConstraints) -> FloatArray:
    """Return (N, 5): x, y (m), vx, vy (m/s) and radius (m), for velocity obstacles, MPC and TEB.

    A circle may contain the robot, since it grows at once when awareness falls. The robot should
    then obey the speed limit and drive so that its distance to the centre does not fall
    (``docs/planners.md``, "Inside a circle").
    """
    rows = [
        [*o.center_odom_m.tolist(), *o.velocity_odom_mps.tolist(), o.radius_m]
        for o in constraints.obstacles
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def points(constraints: NavConstraints, spacing_m: float) -> FloatArray:
    """Return (M, 2) points on the outlines, for planners that read a laser scan or a point cloud.

    Neighbours along an outline, the last and the first included, are at most ``spacing_m`` apart.
    Every outline has at least 8 points.

    An outline may lie around the robot, since obstacles grow at once when awareness falls. A
    planner that cannot cross points then stops. One that can read :func:`circles` knows the way out
    (``docs/planners.md``, "Inside a circle").

    Raises:
        NavError: for a ``spacing_m`` that is not finite or below 1 mm.
    """
    spacing = finite_number("spacing_m", spacing_m, NavError, minimum=_MINIMUM_SPACING_M)
    rings: list[FloatArray] = [np.empty((0, 2))]
    outlines = stretched_outlines(constraints)
    for index, obstacle in enumerate(constraints.obstacles):
        if index in outlines:
            ring = shapely.linearrings(outlines[index])
            step = min(spacing, shapely.length(ring) / _MINIMUM_POINTS)
            rings.append(shapely.get_coordinates(shapely.segmentize(ring, step))[:-1])
            continue
        # The arc is longer than the chord between neighbours, so the spacing is kept.
        count = max(_MINIMUM_POINTS, math.ceil(2.0 * math.pi * obstacle.radius_m / spacing))
        angle = np.arange(count) * (2.0 * math.pi / count)
        directions = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        rings.append(obstacle.center_odom_m + obstacle.radius_m * directions)
    return np.concatenate(rings)


def polygons(constraints: NavConstraints) -> tuple[Polygon, ...]:
    """Return shapely polygons, each of which contains its obstacle's circle.

    A polygon may contain the robot (``docs/planners.md``, "Inside a circle").
    """
    return tuple(obstacle.polygon for obstacle in constraints.obstacles)


def boxes(constraints: NavConstraints) -> FloatArray:
    """Return (N, 7) upright 3-D boxes: centre x, y, z, size x, y, z (m) and yaw (rad).

    Each is the box around the obstacle's outline, on the floor (z = 0) and turned to the direction
    of the person's velocity (yaw 0 for a standing person). Size x is along the yaw direction.

    A box may contain the robot (``docs/planners.md``, "Inside a circle").
    """
    outlines = stretched_outlines(constraints)
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


def stretched_outlines(constraints: NavConstraints) -> dict[int, FloatArray]:
    """Return the corners (M, 2), in metres, of obstacles that are longer than their circle.

    They are those of the polygons' convex hulls. The keys are indices into
    ``constraints.obstacles``.
    """
    obstacles = constraints.obstacles
    if not obstacles:
        return {}
    polygons = [obstacle.polygon for obstacle in obstacles]
    # Each polygon contains its circle, so a longer one has a larger area.
    circles_m2 = math.pi * np.array([obstacle.radius_m for obstacle in obstacles]) ** 2
    stretched = np.flatnonzero(shapely.area(polygons) > _STRETCHED_AREA_RATIO * circles_m2)
    return {
        index: shapely.get_coordinates(shapely.convex_hull(polygons[index]))[:-1]
        for index in stretched.tolist()
    }
