"""The polygon of an obstacle is made when it is first asked for, and is then an ordinary field."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import pytest
import shapely
from nav_scenes import person, settled_update


def test_the_polygon_contains_the_circle_and_is_made_once() -> None:
    (obstacle,) = settled_update([person(position=(3.0, 1.0))]).obstacles
    polygon = obstacle.polygon
    assert polygon is obstacle.polygon
    circle = shapely.Point(*obstacle.center_odom_m).buffer(obstacle.radius_m)
    assert polygon.buffer(1e-9).contains(circle)


def test_copies_have_the_same_polygon() -> None:
    (obstacle,) = settled_update([person(position=(3.0, 1.0))]).obstacles
    copies = (
        pickle.loads(pickle.dumps(obstacle)),
        copy.copy(obstacle),
        replace(obstacle, track_id=7),
    )
    for each in copies:
        assert each.polygon.equals_exact(obstacle.polygon, 0.0)


def test_other_names_are_refused_as_usual() -> None:
    (obstacle,) = settled_update([person(position=(3.0, 1.0))]).obstacles
    with pytest.raises(AttributeError, match="no attribute 'polygons'"):
        _ = obstacle.polygons  # type: ignore[attr-defined]
