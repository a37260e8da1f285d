"""Obstacles that reach beyond their circles: elongated or swept along the way that people walk."""

from __future__ import annotations

from typing import Final

import numpy as np
import shapely

from perception.arrays import FloatArray

from .._constraints import NavConstraints

# A polygon round a circle has corners a little outside of it; this much farther is an outline.
_FARTHER: Final = 1.02


def long_outlines(constraints: NavConstraints) -> dict[int, FloatArray]:
    """Corners (M, 2), m, of the convex hulls of polygons that are more than their circle.

    The keys are indices into ``constraints.obstacles``.
    """
    obstacles = constraints.obstacles
    if not obstacles:
        return {}
    polygons = [obstacle.polygon for obstacle in obstacles]
    corners, owner = shapely.get_coordinates(polygons, return_index=True)
    centers = np.array([obstacle.center_odom_m for obstacle in obstacles])
    radii = np.array([obstacle.radius_m for obstacle in obstacles])
    away = corners - centers[owner]
    far = np.hypot(away[:, 0], away[:, 1]) > _FARTHER * radii[owner]
    if not far.any():
        return {}
    return {
        index: shapely.get_coordinates(shapely.convex_hull(polygons[index]))[:-1]
        for index in np.unique(owner[far]).tolist()
    }
