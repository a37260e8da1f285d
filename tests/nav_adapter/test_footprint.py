"""Distances from the footprint, against shapely's."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import finite, robot_at, rotation
from shapely.geometry import MultiPoint

from nav_adapter import NavError, RobotProfile
from nav_adapter._footprint import Footprint

# Whole millimetres: shapely itself divides by zero on edges of 1e-190 m.
CORNER = st.tuples(*[st.integers(-1000, 1000).map(lambda millimetres: millimetres / 1000.0)] * 2)


@given(
    corners=st.lists(CORNER, min_size=3, max_size=8),
    points=st.lists(st.tuples(finite(-4, 4), finite(-4, 4)), min_size=1, max_size=5),
    heading_rad=finite(-7.0, 7.0),
    position=st.tuples(finite(-20, 20), finite(-20, 20)),
)
def test_distances_agree_with_shapely(
    corners: list[tuple[float, float]],
    points: list[tuple[float, float]],
    heading_rad: float,
    position: tuple[float, float],
) -> None:
    hull = MultiPoint(corners).convex_hull
    if hull.area < 1e-3:
        return
    placed = shapely.transform(hull, lambda c: c @ rotation(heading_rad).T + position)
    odom = np.asarray(points) + position
    ours = Footprint(np.asarray(corners)).distance_m(
        odom, robot_at(position=position, heading_rad=heading_rad)
    )
    np.testing.assert_allclose(ours, shapely.distance(placed, shapely.points(odom)), atol=1e-9)


def test_a_clockwise_outline_has_the_same_distances() -> None:
    square = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    points = np.array([[0.0, 0.0], [3.0, 0.0], [2.0, 2.0]])
    expected = [0.0, 2.0, np.sqrt(2.0)]
    for outline in (square, square[::-1]):
        np.testing.assert_allclose(Footprint(outline).distance_m(points, robot_at()), expected)


def test_a_corner_given_twice_changes_nothing() -> None:
    outline = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1e-200], [0.0, 1.0]])
    distance = Footprint(outline).distance_m(np.array([[3.0, 0.0], [0.2, 0.2]]), robot_at())
    np.testing.assert_allclose(distance, [2.0, 0.0])


@pytest.mark.parametrize(
    ("footprint", "message"),
    [
        ([[0, 0], [1, 1], [2, 2]], "enclose at least 0.002 m², got 0 m²"),
        ([[0, 0], [1, 1]], "at least 3 corners"),
        ([[0, 0], [1, 0], [0, float("nan")]], "finite"),
    ],
)
def test_a_footprint_without_area_is_refused(footprint: object, message: str) -> None:
    with pytest.raises(NavError, match=message):
        RobotProfile(footprint, 1.0, 1.0, 1.0, 0.3)
