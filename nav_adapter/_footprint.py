"""Distances from a robot's footprint to points in the odom frame."""

from __future__ import annotations

import math

import numpy as np
from shapely.geometry import MultiPoint
from shapely.geometry.polygon import orient

from perception.arrays import FloatArray

from ._robot import RobotState

_SHORTEST_EDGE_M = 1e-9


class Footprint:
    """The convex hull of a footprint, prepared for fast distances.

    In plain numpy, which is several times faster for a few people than a shapely polygon at the
    robot's pose. Points are transformed to the base frame, so the hull is prepared only once.

    Args:
        footprint_m: (M, 2) corners in the base frame, not all on one line.
    """

    def __init__(self, footprint_m: FloatArray) -> None:
        hull = orient(MultiPoint(footprint_m).convex_hull, 1.0)
        ring = np.asarray(hull.exterior.coords)
        edges = np.diff(ring, axis=0)
        length2 = (edges**2).sum(axis=1)
        # A corner given twice, up to rounding, makes an edge without a direction.
        has_length = length2 > _SHORTEST_EDGE_M**2
        # (M, 1): one row per edge and one column per point, so that minima are taken over rows.
        self._start_x, self._start_y = ring[:-1][has_length].T[:, :, None].copy()
        self._edge_x, self._edge_y = edges[has_length].T[:, :, None].copy()
        self._edge_length2 = length2[has_length][:, None].copy()

    def distance_m(self, points_odom_m: FloatArray, robot_state: RobotState) -> FloatArray:
        """Return the distances (N,) of points (N, 2) from the footprint, 0 inside."""
        offset_x, offset_y = (points_odom_m - robot_state.position_odom_m).T
        cos, sin = math.cos(robot_state.heading_odom_rad), math.sin(robot_state.heading_odom_rad)
        # (M, N): from each corner to each point, in the base frame.
        to_x = (cos * offset_x + sin * offset_y) - self._start_x
        to_y = (cos * offset_y - sin * offset_x) - self._start_y
        along = (to_x * self._edge_x + to_y * self._edge_y) / self._edge_length2
        np.maximum(along, 0.0, out=along)
        np.minimum(along, 1.0, out=along)
        gap2 = np.square(to_x - along * self._edge_x)
        gap2 += np.square(to_y - along * self._edge_y)
        distance: FloatArray = np.sqrt(gap2.min(axis=0))
        # The hull is counter-clockwise, so a point inside is to the left of every edge.
        distance[(self._edge_x * to_y >= self._edge_y * to_x).all(axis=0)] = 0.0
        return distance
