"""Obstacles stretched along the motion: every shape without a velocity is stretched too."""

from __future__ import annotations

import math

import numpy as np
import shapely
from circle_scenes import Circle, constraints_of, stretched
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import finite
from shapely.geometry import Polygon

from nav_adapter import NavConstraints, boxes, circles, paint_costmap, points

WALKERS = st.tuples(finite(-2, 2), finite(-2, 2), finite(0.3, 2), finite(-2, 2), finite(0.3, 1.2))


def constraints_with(circle: Circle, ahead_m: float) -> NavConstraints:
    return NavConstraints(0.0, (stretched(circle, ahead_m),), 1.0, "robot maximum", False)


@given(circle=WALKERS, ahead_m=finite(0.2, 2.0), spacing_m=finite(0.02, 1.0))
def test_points_are_close_together_on_the_outline(
    circle: Circle, ahead_m: float, spacing_m: float
) -> None:
    constraints = constraints_with(circle, ahead_m)
    outline = constraints.obstacles[0].polygon.exterior
    ring = points(constraints, spacing_m)
    assert shapely.distance(shapely.points(ring), outline).max() < 1e-9
    gaps_m = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
    assert gaps_m.max() <= spacing_m + 1e-9
    assert len(ring) >= 8


@given(circle=WALKERS, ahead_m=finite(0.2, 2.0))
def test_the_box_is_the_smallest_one_along_the_velocity(circle: Circle, ahead_m: float) -> None:
    constraints = constraints_with(circle, ahead_m)
    ((x, y, z, length, width, height, yaw),) = boxes(constraints)
    assert yaw == math.atan2(circle[3], circle[2])
    assert (z, height) == (0.85, 1.7)
    assert math.isclose(length, 2.02 * circle[4] + ahead_m, rel_tol=1e-2)
    assert math.isclose(width, 2.02 * circle[4], rel_tol=1e-2)
    c, s = math.cos(yaw), math.sin(yaw)
    half = 0.5 * np.array([length, width]) + 1e-9
    corners = half * [[1, 1], [-1, 1], [-1, -1], [1, -1]] @ np.array([[c, s], [-s, c]]) + [x, y]
    assert Polygon(corners).contains(constraints.obstacles[0].polygon)


@settings(max_examples=25)
@given(circle=WALKERS, ahead_m=finite(0.2, 2.0), others=st.booleans())
def test_the_costs_of_an_outline_follow_the_polygon(
    circle: Circle, ahead_m: float, others: bool
) -> None:
    long = constraints_with(circle, ahead_m)
    round_ones = constraints_of((4.0, 4.0, 0.0, 0.0, 0.8)).obstacles if others else ()
    both = NavConstraints(0.0, (*round_ones, *long.obstacles), 1.0, "robot maximum", False)
    costmap = paint_costmap(np.zeros((100, 100), dtype=np.uint8), (-5, -5), 0.1, both)
    columns, rows = np.meshgrid(np.arange(100), np.arange(100))
    cells = shapely.points(0.1 * (columns + 0.5) - 5.0, 0.1 * (rows + 0.5) - 5.0)
    everything = shapely.union_all([obstacle.polygon for obstacle in both.obstacles])
    gap_m = shapely.distance(cells, everything)
    # A round obstacle is painted as its circle, 1 % smaller than the polygon around it.
    round_part = shapely.distance(cells, shapely.points(4.0, 4.0)) < 0.82 if others else False
    assert (costmap[(gap_m == 0.0) & ~np.asarray(round_part)] == 254).all()
    assert (costmap[gap_m > 0.001] < 254).all()
    assert (costmap[(gap_m > 0.0) & (gap_m < 0.54)] > 0).all()
    assert (costmap[gap_m > 0.58] == 0).all()


@given(circle=WALKERS, ahead_m=finite(0.2, 2.0))
def test_circles_stay_round(circle: Circle, ahead_m: float) -> None:
    assert circles(constraints_with(circle, ahead_m)).tolist() == [list(circle)]
