"""Racks and walls as points, polygons, circles and half-planes, against shapely."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import finite
from shapely.geometry import Point

from nav_adapter import NavError
from nav_adapter.exporters import (
    static_circles,
    static_half_planes,
    static_points,
    static_polygons,
)
from perception.arrays import FloatArray

ROBOT_RADIUS_M = 0.45
EDGES = st.tuples(finite(-4.0, 4.0), finite(-4.0, 4.0), finite(0.02, 4.0), finite(0.02, 4.0))
BOX = EDGES.map(lambda box: (box[0], box[1], box[0] + box[2], box[1] + box[3]))
BOXES = st.lists(BOX, max_size=3).map(lambda boxes: np.array(boxes).reshape(-1, 4))


@given(box=BOX, spacing_m=finite(0.02, 1.0))
def test_points_lie_on_the_outline_with_corners_and_spacing(
    box: tuple[float, float, float, float], spacing_m: float
) -> None:
    points = static_points([box], spacing_m)
    (polygon,) = static_polygons([box])
    assert polygon.exterior.is_ccw
    assert polygon.bounds == box
    assert shapely.distance(shapely.points(points), polygon.exterior).max() < 1e-9
    gaps = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1)
    assert gaps.max() <= spacing_m + 1e-9
    corners = np.array(polygon.exterior.coords)[:4]
    apart = np.linalg.norm(corners[:, None] - points, axis=-1)
    assert apart.min(axis=1).max() < 1e-9
    # No more points than the spacing asks for.
    sides = np.tile(polygon.bounds[2:] - np.array(polygon.bounds[:2]), 2)
    assert len(points) <= np.ceil(sides / spacing_m - 1e-9).sum() + 4


@given(boxes=BOXES)
def test_boxes_come_one_after_the_other(boxes: FloatArray) -> None:
    for form in (static_polygons, lambda some: static_points(some, 0.3)):
        apart = [row for box in boxes for row in form([box])]
        assert [*map(str, form(boxes))] == [*map(str, apart)]
    circles = [static_circles([box], 0.2) for box in boxes]
    np.testing.assert_array_equal(
        static_circles(boxes, 0.2), np.vstack([np.empty((0, 5)), *circles])
    )


@settings(max_examples=60)
@given(box=BOX, overshoot_m=finite(0.03, 0.5))
def test_circles_cover_a_box_and_no_more_than_the_overshoot(
    box: tuple[float, float, float, float], overshoot_m: float
) -> None:
    circles = static_circles([box], overshoot_m)
    assert not circles[:, 2:4].any()
    polygon = shapely.box(*box)
    # No circle is farther out than stated.
    angle = np.linspace(0.0, math.tau, 361)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    for x, y, _, _, radius in circles:
        assert polygon.covers(Point(x, y))
        outline = shapely.points([x, y] + radius * around)
        assert shapely.distance(outline, polygon).max() <= overshoot_m + 1e-9
    # Every point of a fine grid over the box, the edge included, is in a circle.
    x, y = np.meshgrid(np.linspace(box[0], box[2], 41), np.linspace(box[1], box[3], 41))
    gap = np.hypot(x[..., None] - circles[:, 0], y[..., None] - circles[:, 1]) - circles[:, 4]
    assert gap.min(axis=-1).max() <= 1e-9


def test_a_coarser_cover_has_fewer_circles() -> None:
    rack = [[0.0, 0.0, 6.0, 1.0]]
    counts = [len(static_circles(rack, overshoot_m)) for overshoot_m in (0.05, 0.1, 0.2, 0.5)]
    assert counts == sorted(counts, reverse=True)
    assert counts[1] == 40  # as the docstring says
    assert len(static_circles([[0.0, 0.0, 1.0, 1.0]], 1.0)) == 1


def gap_m(box: FloatArray, position: Any) -> float:
    return float(shapely.distance(shapely.box(*box), Point(*position))) - ROBOT_RADIUS_M


VELOCITIES = st.tuples(finite(-2.0, 2.0), finite(-2.0, 2.0))


@given(box=BOX, position=VELOCITIES, tried=VELOCITIES, horizon_s=finite(0.5, 6.0))
def test_an_allowed_velocity_touches_no_box_within_the_horizon(
    box: tuple[float, float, float, float],
    position: tuple[float, float],
    tried: tuple[float, float],
    horizon_s: float,
) -> None:
    if gap_m(np.array(box), position) < 0.0:
        return  # the other test
    ((nx, ny, bound),) = static_half_planes([box], position, ROBOT_RADIUS_M, horizon_s=horizon_s)
    normal = np.array([nx, ny])
    assert math.hypot(nx, ny) == pytest.approx(1.0)
    assert bound <= 0.0  # standing is allowed
    # The tried velocity itself if it is allowed, else the nearest allowed one.
    allowed = np.array(tried) + max(bound - normal @ tried, 0.0) * normal
    for t_s in np.linspace(0.0, horizon_s, 13):
        assert gap_m(np.array(box), position + t_s * allowed) >= -1e-6
    # Straight at the box, the bound uses the gap up.
    assert gap_m(np.array(box), position + horizon_s * bound * normal) == pytest.approx(
        0.0, abs=1e-6
    )


@given(box=BOX, along=finite(0.0, 1.0), across=finite(0.0, 1.0), out=finite(-0.4, 0.4))
def test_a_robot_that_overlaps_a_box_gets_out_in_time(
    box: tuple[float, float, float, float], along: float, across: float, out: float
) -> None:
    low, high = np.array(box[:2]), np.array(box[2:])
    position = low + np.array([along, across]) * (high - low) + [out, 0.0]
    if gap_m(np.array(box), position) >= 0.0:
        return
    ((nx, ny, bound),) = static_half_planes([box], position, ROBOT_RADIUS_M, resolve_s=0.5)
    assert bound >= 0.0
    there = position + 0.5 * bound * np.array([nx, ny])
    assert gap_m(np.array(box), there) == pytest.approx(0.0, abs=1e-6)


def test_without_boxes_every_form_is_empty() -> None:
    none = np.zeros((0, 4))
    assert static_points(none, 0.1).shape == (0, 2)
    assert static_polygons(none) == ()
    assert static_circles(none, 0.1).shape == (0, 5)
    assert static_half_planes(none, (0, 0), 0.4).shape == (0, 3)


def test_wrong_boxes_and_numbers_are_refused() -> None:
    flat = [[0.0, 0.0, 1.0, 1.0], [2.0, 1.0, 2.0, 3.0]]
    for form in (
        static_polygons,
        lambda boxes: static_points(boxes, 0.1),
        lambda boxes: static_circles(boxes, 0.1),
        lambda boxes: static_half_planes(boxes, (0, 0), 0.4),
    ):
        with pytest.raises(NavError, match=r"x_min < x_max .* row 1 is \[2.0, 1.0, 2.0, 3.0\]"):
            form(flat)
        with pytest.raises(NavError, match=r"boxes_odom_m must have shape \(N, 4\)"):
            form([[0.0, 1.0]])
    with pytest.raises(NavError, match="spacing_m"):
        static_points(flat[:1], 0.0)
    with pytest.raises(NavError, match="overshoot_m"):
        static_circles(flat[:1], 1e-6)
    with pytest.raises(NavError, match="horizon_s"):
        static_half_planes(flat[:1], (0, 0), 0.4, horizon_s=0.0)
