"""Culling leaves out only what the image cannot show."""

from __future__ import annotations

import math

import numpy as np
import pytest
from camera_poses import level_pose
from hypothesis import given, settings
from hypothesis import strategies as st

from perception import Camera
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import WarehouseLayout
from sim_tests.world.render import RenderView, _visuals, box_corners, in_view, to_camera

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


@settings(max_examples=60, deadline=None)
@given(_BOXES, _POSES, st.sampled_from([None, (3.0, 4.0, 9.0, 8.0), (-20.0, 5.0, 60.0, 6.0)]))
def test_a_box_that_any_ray_meets_is_in_view(
    numbers: list[tuple[float, ...]], pose: tuple[float, ...], roi: tuple[float, ...] | None
) -> None:
    view, boxes = _view(pose, roi), _boxes(numbers)
    met = ~np.isnan(_hit_depths(view, boxes)).all(axis=0)
    shown = in_view(view, to_camera(view, box_corners(boxes)))
    assert (shown | ~met).all()


def test_a_box_between_the_samples_is_left_out() -> None:
    view = _view((0.0, 0.0, 0.0, 0.0, 0.0))
    # A sample at x = 10 m every 10 / 33 m; columns count to the right, odom y to the left.
    middle = -(20.0 - CAMERA.cx_px) / CAMERA.fx_px * 10.0
    between = middle - 0.5 * 10.0 / CAMERA.fx_px
    for y, seen in ((middle, True), (between, False)):
        post = np.array([[[10.0, y - 0.01, -1.0], [10.02, y + 0.01, 1.0]]])
        assert in_view(view, to_camera(view, box_corners(post))).tolist() == [seen]


def test_images_with_and_without_culling_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cameras stand in aisles, in front of a rack, above it, in it, and outside the hall."""
    rng = np.random.default_rng(5)
    camera = Camera.from_fov(160, 120, math.radians(75.0))
    layout = WarehouseLayout.named("blind_corner")
    with Warehouse(layout) as hall:
        renderer = CameraRenderer(hall)
        for number in range(6):
            place = (
                rng.uniform(layout.x_min_m - 1.0, layout.x_max_m + 1.0),
                rng.uniform(layout.y_min_m - 1.0, layout.y_max_m + 1.0),
                rng.choice([0.3, 1.4, 4.3]),
            )
            T = level_pose(place, rng.uniform(-math.pi, math.pi), rng.normal(0.0, 0.25))
            roi = None if number % 3 else (40.0, 30.0, 110.0, 90.0)
            lean = renderer.render(camera, T, roi)
            with monkeypatch.context() as patch:
                patch.setattr(_visuals, "in_view", lambda _, corners: np.ones(len(corners), bool))
                full = renderer.render(camera, T, roi)
            np.testing.assert_array_equal(lean.rgb, full.rgb)
            np.testing.assert_array_equal(lean.depth_m, full.depth_m)
            np.testing.assert_array_equal(lean.body_ids, full.body_ids)
