"""Obstacles in the shapes that planners read: circles, points, polygons, boxes.

Pure functions of the constraints, in the odom frame. They have one entry per person, in the order
of ``constraints.obstacles``, and return an empty array or tuple without people.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from shapely.geometry import Polygon

from perception.arrays import FloatArray, finite_number

from .._constraints import NavConstraints
from .._errors import NavError

# A smaller spacing only costs memory.
_MINIMUM_SPACING_M: Final = 1e-3
_MINIMUM_POINTS: Final = 8


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
    for obstacle in constraints.obstacles:
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
    rows = []
    for obstacle in constraints.obstacles:
        (x, y), (vx, vy) = obstacle.center_odom_m, obstacle.velocity_odom_mps
        size = 2.0 * obstacle.radius_m
        yaw, height = math.atan2(vy, vx), obstacle.height_m
        rows.append([x, y, 0.5 * height, size, size, height, yaw])
    return np.array(rows, dtype=np.float64).reshape(-1, 7)
