"""Layouts as data: places of things, refused layouts, and shipped layouts that never change."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests.world.hall import LAYOUTS, PROP_PARTS, Prop, WarehouseLayout


def _blocked(layout: WarehouseLayout, start: tuple[float, float], end: tuple[float, float]) -> bool:
    """Return whether an obstacle's footprint lies on the way, sampled every centimetre."""
    steps = math.ceil(100.0 * math.dist(start, end)) + 1
    points = np.linspace(start, end, steps)[:, None]
    boxes = layout.obstacle_boxes_odom
    return bool(((points > boxes[:, :2]) & (points < boxes[:, 2:])).all(axis=2).any())


def test_the_boxes_of_the_crossing_are_those_of_the_published_results() -> None:
    expected = [
        *[(-3.3, 1.6, 4.5, 2.7), (7.5, 1.6, 15.3, 2.7)],
        *[(-3.3, 5.1, 4.5, 6.2), (7.5, 5.1, 15.3, 6.2)],
        *[(-3.3, -2.7, 4.5, -1.6), (7.5, -2.7, 15.3, -1.6)],
        *[(-3.3, -6.2, 4.5, -5.1), (7.5, -6.2, 15.3, -5.1)],
        (-5.2, -8.7, -5.0, 8.7),
        (17.0, -8.7, 17.2, 8.7),
        (-5.0, -8.7, 17.0, -8.5),
        (-5.0, 8.5, 17.0, 8.7),
    ]
    layout = WarehouseLayout.named("crossing")
    np.testing.assert_allclose(layout.obstacle_boxes_odom, expected, atol=1e-12)
    np.testing.assert_array_equal(layout.obstacle_heights_m, [4.0] * 8 + [6.0] * 4)


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_hall_has_a_free_robot_aisle_and_no_overlapping_things(name: str) -> None:
    layout = WarehouseLayout.named(name)
    boxes = layout.obstacle_boxes_odom
    assert boxes.shape == (len(layout.obstacle_heights_m), 4)
    assert (boxes[:, :2] < boxes[:, 2:]).all()
    assert (layout.obstacle_heights_m > 0.0).all()
    assert not _blocked(layout, (-3.0, 0.0), (5.5, 0.0))
    things = [*((rack.box_odom_m,) for rack in layout.racks)]
    things += [prop.boxes_odom_m for prop in layout.props]
    for one, other in itertools.combinations(things, 2):
        for a, b in itertools.product(one, other):
            shared = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
            assert min(shared) < 1e-9, (a, b)


def test_a_hall_survives_its_file(tmp_path: Path) -> None:
    layout = WarehouseLayout.named("staging_hall")
    layout.to_yaml(tmp_path / "hall.yaml")
    assert WarehouseLayout.from_yaml(tmp_path / "hall.yaml") == layout


@given(
    st.sampled_from(sorted(PROP_PARTS)),
    st.floats(-360.0, 360.0),
    st.floats(-9.0, 9.0),
    st.floats(-9.0, 9.0),
)
def test_the_boxes_of_a_prop_bound_its_rotated_parts(kind, yaw, x, y) -> None:
    prop = Prop(kind=kind, x_m=x, y_m=y, yaw_deg=yaw)
    c, s = math.cos(math.radians(yaw)), math.sin(math.radians(yaw))
    rotation = np.array([[c, -s], [s, c]])
    for part, box in zip(PROP_PARTS[kind], prop.boxes_odom_m, strict=True):
        half = 0.5 * np.array([part.length_m, part.width_m])
        corners = [
            (part.x_m + sx * half[0], part.y_m + sy * half[1]) for sx in (-1, 1) for sy in (-1, 1)
        ]
        odom = np.array(corners) @ rotation.T + (x, y)
        np.testing.assert_allclose(box[:2], odom.min(axis=0), atol=1e-9)
        np.testing.assert_allclose(box[2:], odom.max(axis=0), atol=1e-9)
