"""Visibility on the floor plan, by rays through the physics world, and in depth images."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests.actors.body import Worker
from sim_tests.actors.robot import Amr
from sim_tests.world import (
    FACE_DEPTH_M,
    FACE_KEYPOINTS,
    JOINT_DEPTH_M,
    Warehouse,
    crosses_boxes,
    keypoints_in_front,
    sees,
)
from sim_tests.world.hall import WarehouseLayout

_PLACES = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
_BOXES = st.lists(
    st.tuples(_PLACES, st.floats(0.1, 3.0), st.floats(0.1, 3.0)), min_size=1, max_size=4
)


@given(_BOXES, _PLACES, st.lists(_PLACES, min_size=1, max_size=5))
def test_a_line_crosses_a_box_where_one_of_its_points_lies_inside(numbers, start, ends) -> None:
    boxes = np.array([(x, y, x + length, y + width) for (x, y), length, width in numbers])
    crossed = crosses_boxes(boxes, start, ends)
    shares = np.linspace(0.0, 1.0, 501)[:, None]
    for end, found in zip(ends, crossed, strict=True):
        points = (1.0 - shares) * np.array(start) + shares * np.array(end)
        margins = np.concatenate(
            [points[:, None] - boxes[:, :2], boxes[:, 2:] - points[:, None]], axis=2
        ).min(axis=2)
        # Every point that lies clearly inside a box is found, …
        assert found or not (margins > 1e-6).any()
        # … and a line that keeps more than the sampling's step away from all boxes is not.
        step_m = math.dist(start, end) / 500.0
        assert not found or (margins > -step_m - 1e-6).any()


def test_a_rack_blocks_the_view_and_a_body_that_does_not_count_does_not() -> None:
    layout = WarehouseLayout.named("crossing")
    with Warehouse(layout) as warehouse:
        amr = Amr(warehouse)
        worker = Worker(warehouse, 1.75, position_odom_m=(3.0, 0.0), heading_odom_rad=math.pi)
        x_min, y_min, x_max, y_max = layout.racks[0].box_odom_m
        behind_the_rack = np.array([0.5 * (x_min + x_max), y_max + 0.3, 1.2])
        assert not sees(worker, behind_the_rack)
        assert sees(worker, np.array([0.5 * (x_min + x_max), y_min - 0.3, 1.2]))
        inside_the_robot = np.array([0.0, 0.0, 0.15])
        assert not sees(worker, inside_the_robot)
        assert sees(worker, inside_the_robot, through=frozenset({amr.body}))
        # Nothing can come between the eyes and a point inside the head.
        assert sees(worker, worker.eyes_odom_m + np.array([0.1, 0.0, 0.0]))


@pytest.mark.parametrize(
    ("row", "tolerance_m"), [(0, FACE_DEPTH_M), (FACE_KEYPOINTS, JOINT_DEPTH_M)]
)
def test_a_keypoint_is_visible_up_to_its_tolerance_behind_a_surface(row, tolerance_m) -> None:
    depth = np.full((10, 20), 2.0)
    for behind_m, visible in (
        (-0.5, True),
        (tolerance_m - 1e-6, True),
        (tolerance_m + 1e-6, False),
    ):
        points = np.full((row + 1, 3), 2.0 + behind_m)
        pixels = np.full((row + 1, 2), 4.0)
        assert keypoints_in_front(points, pixels, depth)[row] == visible
