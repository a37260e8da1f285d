"""Obstacles that reach beyond their circles: elongated or swept along the way that people walk."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import shapely

from perception.arrays import FloatArray

from .._constraints import NavConstraints

# A polygon of 24 sides about a circle has 0.6 % more area; one with this much more is an outline,
# longer than the circle by a fiftieth of the radius or more.
_LARGER: Final = 1.02


def long_outlines(constraints: NavConstraints) -> dict[int, FloatArray]:
    """Corners (M, 2), m, of the convex hulls of polygons that are more than their circle.

    The keys are indices into ``constraints.obstacles``.
    """
    obstacles = constraints.obstacles
    if not obstacles:
        return {}
    polygons = [obstacle.polygon for obstacle in obstacles]
    # Polygons contain their circles, so what is longer is larger.
    circles_m2 = math.pi * np.array([obstacle.radius_m for obstacle in obstacles]) ** 2
    long = np.flatnonzero(shapely.area(polygons) > _LARGER * circles_m2)
    return {
        index: shapely.get_coordinates(shapely.convex_hull(polygons[index]))[:-1]
        for index in long.tolist()
    }
