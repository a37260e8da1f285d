"""The shapes of the obstacles: circles, points, polygons and boxes."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import ROBOT, crowds, finite, person, robot_at
from shapely.geometry import Point

from nav_adapter import (
    AwarenessPolicy,
    NavAdapter,
    NavConstraints,
    NavError,
    boxes,
    circles,
    points,
    polygons,
)
from tracking import PersonTrack

NOBODY = NavConstraints(0.0, (), 1.0, "robot maximum", False)


def constraints_for(tracks: tuple[PersonTrack, ...]) -> NavConstraints:
    return NavAdapter(AwarenessPolicy(), ROBOT).update(tracks, robot_at(), 0.0)


@given(tracks=crowds(), spacing_m=finite(0.01, 2.0))
def test_all_shapes_agree(tracks: tuple[PersonTrack, ...], spacing_m: float) -> None:
    constraints = constraints_for(tracks)
    rows = circles(constraints)
    assert rows.shape == (len(tracks), 5)
    assert boxes(constraints).shape == (len(tracks), 7)
    assert len(polygons(constraints)) == len(tracks)
    perimeter = points(constraints, spacing_m)
    for (x, y, vx, vy, radius), box, polygon, obstacle in zip(
        rows, boxes(constraints), polygons(constraints), constraints.obstacles, strict=True
    ):
        assert [x, y] == obstacle.center_odom_m.tolist()
        assert [vx, vy] == obstacle.velocity_odom_mps.tolist()
        assert radius == obstacle.radius_m

        # The polygon contains the circle and is hardly larger.
        inner = polygon.exterior.distance(Point(x, y))
        outer = shapely.hausdorff_distance(polygon, Point(x, y))
        assert inner == pytest.approx(radius, rel=1e-9)
        assert radius < outer < 1.01 * radius

        np.testing.assert_allclose(box[:6], [x, y, 0.85, 2 * radius, 2 * radius, 1.7])
        speed = math.hypot(vx, vy)
        np.testing.assert_allclose(
            speed * np.array([math.cos(box[6]), math.sin(box[6])]), [vx, vy], atol=1e-12
        )

        count = max(8, math.ceil(2 * math.pi * radius / spacing_m))
        ring, perimeter = perimeter[:count], perimeter[count:]
        np.testing.assert_allclose(np.linalg.norm(ring - [x, y], axis=1), radius)
        gaps = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
        assert gaps.max() <= spacing_m + 1e-12
    assert len(perimeter) == 0


def test_without_people_every_shape_is_empty() -> None:
    assert circles(NOBODY).shape == (0, 5)
    assert points(NOBODY, 0.1).shape == (0, 2)
    assert boxes(NOBODY).shape == (0, 7)
    assert polygons(NOBODY) == ()


@given(spacing_m=st.sampled_from([0.0, -1.0, 1e-9, math.nan, math.inf]))
def test_an_invalid_spacing_is_refused(spacing_m: float) -> None:
    with pytest.raises(NavError, match="spacing_m must"):
        points(constraints_for((person(),)), spacing_m)
