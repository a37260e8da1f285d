"""Culling leaves out only what the image cannot show."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from camera_poses import level_pose
from hypothesis import given, settings
from hypothesis import strategies as st

from perception import Camera
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import WarehouseLayout
from sim_tests.world.render import RenderView, box_corners, hidden_behind, in_view, to_camera

CAMERA = Camera(40, 30, 33.0, 31.0, 17.3, 16.1)
_SIDES = st.floats(0.02, 3.0)
_PLACES = st.floats(-6.0, 6.0)
_BOXES = st.lists(
    st.tuples(_PLACES, _PLACES, _PLACES, _SIDES, _SIDES, _SIDES), min_size=1, max_size=8
)
_POSES = st.tuples(
    _PLACES, _PLACES, st.floats(-2.0, 2.0), st.floats(-3.2, 3.2), st.floats(-1.2, 1.2)
)


def _view(
    pose: tuple[float, ...], roi: tuple[float, ...] | None = None, **others: object
) -> RenderView:
    x, y, z, heading, pitch = pose
    return RenderView.of_rectangle(CAMERA, level_pose((x, y, z), heading, pitch), roi, **others)


def _boxes(numbers: list[tuple[float, ...]]) -> np.ndarray:
    rows = np.array(numbers)
    return np.stack([rows[:, :3], rows[:, :3] + rows[:, 3:]], axis=1)


def _rays(view: RenderView) -> np.ndarray:
    """Return rays (h · w, 3) in odom through the samples, one metre deep."""
    u = view.left + (np.arange(view.width) + 0.5) / view.width * (view.right - view.left)
    v = view.top + (np.arange(view.height) + 0.5) / view.height * (view.bottom - view.top)
    grid = np.stack([*np.meshgrid(u, v), np.ones((view.height, view.width))], axis=-1)
    return grid.reshape(-1, 3) @ view.T_odom_camera[:3, :3].T


def _hit_depths(view: RenderView, boxes: np.ndarray) -> np.ndarray:
    """Return the depths (rays, N) at which each ray enters each box; NaN for a miss."""
    eye, rays = view.T_odom_camera[:3, 3], _rays(view)
    with np.errstate(divide="ignore", invalid="ignore"):
        first = (boxes[None, :, 0] - eye) / rays[:, None]
        last = (boxes[None, :, 1] - eye) / rays[:, None]
    enter = np.minimum(first, last).max(axis=-1)
    leave = np.maximum(first, last).min(axis=-1)
    missed = ~((enter <= leave) & (leave >= view.near_m) & (enter <= view.far_m))
    enter = np.maximum(enter, view.near_m)
    enter[missed] = np.nan
    return enter


@settings(max_examples=150, deadline=None)
@given(_BOXES, _POSES, st.sampled_from([None, (3.0, 4.0, 9.0, 8.0), (-20.0, 5.0, 60.0, 6.0)]))
def test_a_box_that_any_ray_meets_is_in_view(
    numbers: list[tuple[float, ...]], pose: tuple[float, ...], roi: tuple[float, ...] | None
) -> None:
    view, boxes = _view(pose, roi), _boxes(numbers)
    met = ~np.isnan(_hit_depths(view, boxes)).all(axis=0)
    shown = in_view(view, to_camera(view, box_corners(boxes)))
    assert (shown | ~met).all()


@settings(max_examples=150, deadline=None)
@given(_BOXES, _BOXES, _POSES)
def test_a_hidden_box_has_an_occluder_in_front_on_every_ray(
    numbers: list[tuple[float, ...]], solids: list[tuple[float, ...]], pose: tuple[float, ...]
) -> None:
    view, boxes, occluders = _view(pose), _boxes(numbers), _boxes(solids)
    hidden = hidden_behind(view, box_corners(boxes), occluders)
    depths = _hit_depths(view, boxes)
    cover = np.nan_to_num(_hit_depths(view, occluders), nan=np.inf).min(axis=1)
    for box in np.flatnonzero(hidden):
        met = ~np.isnan(depths[:, box])
        assert (cover[met] <= depths[met, box] + 1e-9).all()


def test_a_wall_hides_boxes_behind_it_and_none_beside_or_in_front() -> None:
    view = _view((0.0, 0.0, 1.0, 0.0, 0.0))
    wall = np.array([[[3.0, -2.0, -1.0], [3.1, 2.0, 4.0]]])
    boxes = np.array(
        [
            [[5.0, -0.5, 0.0], [6.0, 0.5, 2.0]],  # behind
            [[5.0, 3.0, 0.0], [6.0, 4.0, 2.0]],  # behind, sticking out of the shadow
            [[1.0, -0.5, 0.0], [2.0, 0.5, 2.0]],  # in front
            [[2.0, -0.5, 0.0], [5.0, 0.5, 2.0]],  # through the wall
            [[3.2, -1.9, 0.0], [3.4, 1.9, 2.0]],  # behind, nearly as wide
        ]
    )
    hidden = hidden_behind(view, box_corners(boxes), wall)
    assert hidden.tolist() == [True, False, False, False, True]
    # A wall that the camera stands in, or that the near plane may cut open, hides nothing.
    inside = _view((3.05, 0.0, 1.0, 0.0, 0.0))
    assert not hidden_behind(inside, box_corners(boxes), wall).any()
    close = _view((2.98, 0.0, 1.0, 0.0, 0.0), near_m=0.05)
    assert not hidden_behind(close, box_corners(boxes), wall).any()


def test_a_box_between_the_samples_is_left_out() -> None:
    view = _view((0.0, 0.0, 0.0, 0.0, 0.0))
    # A sample at x = 10 m every 10 / 33 m; columns count to the right, odom y to the left.
    middle = -(20.0 - CAMERA.cx_px) / CAMERA.fx_px * 10.0
    between = middle - 0.5 * 10.0 / CAMERA.fx_px
    for y, seen in ((middle, True), (between, False)):
        post = np.array([[[10.0, y - 0.01, -1.0], [10.02, y + 0.01, 1.0]]])
        assert in_view(view, to_camera(view, box_corners(post))).tolist() == [seen]


@pytest.fixture(scope="module", params=["crossing", "open_floor", "blind_corner"])
def hall(request: pytest.FixtureRequest) -> Iterator[Warehouse]:
    with Warehouse(getattr(WarehouseLayout, request.param)()) as warehouse:
        yield warehouse


def test_images_with_and_without_culling_are_the_same(hall: Warehouse) -> None:
    """Cameras stand in aisles, in front of a rack, above it, in it, and outside the hall."""
    rng = np.random.default_rng(5)
    renderer, layout = CameraRenderer(hall), hall.layout
    camera = Camera.from_fov(200, 150, math.radians(75.0))
    shares = []
    for number in range(24):
        place = (
            rng.uniform(layout.x_min_m - 1.0, layout.x_max_m + 1.0),
            rng.uniform(layout.y_min_m - 1.0, layout.y_max_m + 1.0),
            rng.choice([0.3, 1.4, 1.7, 4.3]),
        )
        T = level_pose(place, rng.uniform(-math.pi, math.pi), rng.normal(0.0, 0.25))
        roi = None if number % 3 else (60.0, 40.0, 130.0, 110.0)
        hall.visuals.culling = True
        lean = renderer.render(camera, T, roi)
        view = RenderView.of_rectangle(camera, T, roi)
        hall.visuals.prepare(view)
        shares.append(hall.visuals.shown_statics / hall.visuals.statics)
        hall.visuals.culling = False
        full = renderer.render(camera, T, roi)
        hall.visuals.culling = True
        np.testing.assert_array_equal(lean.rgb, full.rgb)
        np.testing.assert_array_equal(lean.depth_m, full.depth_m)
        np.testing.assert_array_equal(lean.body_ids, full.body_ids)
    assert np.mean(shares) < 0.5
