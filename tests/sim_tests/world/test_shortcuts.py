"""Shortcuts of rendering leave out only what the image cannot show, or what nobody looks at."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from camera_poses import level_pose
from hypothesis import given, settings
from hypothesis import strategies as st
from visual_actors import ball

from perception import Camera
from sim_tests import Scenario
from sim_tests.crossing import Stage
from sim_tests.world import Warehouse
from sim_tests.world.camera import FINE_PX_PER_M, CameraRenderer, CoarseSceneryRenderer
from sim_tests.world.hall import WarehouseLayout
from sim_tests.world.render import _visuals
from sim_tests.world.render._backend_tiny import cut_texture


def test_images_with_and_without_culling_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Things hang all over the hall, near and far, and in part beside the images."""
    rng = np.random.default_rng(5)
    camera = Camera.from_fov(160, 120, math.radians(75.0))
    layout = WarehouseLayout.named("open")
    low, high = (layout.x_min_m, layout.y_min_m, 0.0), (layout.x_max_m, layout.y_max_m, 4.0)
    shown = set()
    with Warehouse(layout) as hall:
        for place in rng.uniform(low, high, (60, 3)).tolist():
            hall.visuals.add_actor(ball(0.4, position_m=tuple(place)))
        renderer = CameraRenderer(hall)
        for number in range(6):
            T = level_pose(tuple(rng.uniform(low, high)), rng.uniform(-math.pi, math.pi), 0.2)
            roi = None if number % 3 else (40.0, 30.0, 110.0, 90.0)
            lean = renderer.render(camera, T, roi)
            with monkeypatch.context() as patch:
                patch.setattr(_visuals, "in_view", lambda _, corners: np.ones(len(corners), bool))
                full = renderer.render(camera, T, roi)
            np.testing.assert_array_equal(lean.rgb, full.rgb)
            np.testing.assert_array_equal(lean.depth_m, full.depth_m)
            np.testing.assert_array_equal(lean.actors, full.actors)
            shown |= set(np.unique(full.actors).tolist())
    assert len(shown) > 8


CAMERA = Camera.from_fov(768, 480, math.radians(100.0))
DIVISOR = 3


@pytest.fixture(scope="module")
def stage() -> Iterator[Stage]:
    with Stage(Scenario.shipped("crossing_attentive")) as stage:
        yield stage


@pytest.mark.parametrize(("x_m", "y_m"), [(2.4, 0.4), (4.0, -1.5), (6.5, 0.0)])
def test_people_are_as_in_the_full_image_and_depths_are_true(stage: Stage, x_m: float, y_m: float):
    worker, T = stage.workers[0], stage.amr.T_odom_camera
    worker.place((x_m, y_m), 2.5)
    full = CameraRenderer(stage.warehouse).render(CAMERA, T)
    view = CoarseSceneryRenderer(stage.warehouse, DIVISOR).render(CAMERA, T)
    assert view.rgb.shape == full.rgb.shape
    # No person is so near that they need fewer samples than the image has pixels.
    assert CAMERA.fx_px / (x_m - T[0, 3] - 0.5) < 2.0 * FINE_PX_PER_M
    shown = full.actors == worker.actor
    assert shown.sum() > 300
    np.testing.assert_array_equal(view.actors == worker.actor, shown)
    # Rounding sometimes moves a sample across a texel's edge.
    assert (view.rgb[shown] == full.rgb[shown]).mean() > 0.999
    np.testing.assert_allclose(view.depth_m[shown], full.depth_m[shown], rtol=1e-4)
    # The depths of the hall are true, but come from samples at most a block away.
    same = np.isclose(view.depth_m, full.depth_m, rtol=0.03)
    assert same.mean() > 0.85
    assert not np.array_equal(view.rgb, full.rgb)


def _colours(uv: np.ndarray, texture: np.ndarray) -> np.ndarray:
    """Return the texel that each coordinate (N, 2) falls on."""
    height, width = texture.shape[:2]
    column = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
    row = np.clip(((1.0 - uv[:, 1]) * height).astype(int), 0, height - 1)
    return texture[row, column]


def _inside(uv: np.ndarray, indices: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return twenty points in every triangle, away from its edges."""
    weights = rng.dirichlet((2.0, 2.0, 2.0), (len(indices) // 3, 20))
    return np.einsum("tpk,tkc->tpc", weights, uv[indices.reshape(-1, 3)]).reshape(-1, 2)


def _same_look(
    uv: np.ndarray, indices: np.ndarray, texture: np.ndarray
) -> tuple[float, np.ndarray]:
    """Return the share of points with the same colour before and after, and the cut texture."""
    cut_uv, cut = cut_texture(uv, indices, texture)
    before = _colours(_inside(uv, indices, np.random.default_rng(0)), texture)
    after = _colours(_inside(cut_uv, indices, np.random.default_rng(0)), cut)
    return float((before == after).all(axis=1).mean()), cut


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 30), st.floats(0.01, 0.3), st.integers(3, 90), st.integers(3, 90), st.integers(0)
)
def test_scattered_triangles_keep_their_colours(triangles, extent, height, width, seed) -> None:
    rng = np.random.default_rng(seed)
    texture = rng.integers(0, 256, (height, width, 3)).astype(np.uint8)
    centres = rng.uniform(extent, 1.0 - extent, (triangles, 1, 2))
    uv = centres + rng.uniform(-extent, extent, (triangles, 3, 2))
    share, cut = _same_look(uv.reshape(-1, 2), np.arange(3 * triangles), texture)
    # A point on the border of two texels may round to either.
    assert share > 0.999
    assert cut.size <= texture.size


@pytest.mark.parametrize(
    "uv", [[(0.0, 0.0), (3.0, 0.0), (0.0, 3.0)], [(-0.1, 0.0), (0.2, 0.0), (0.0, 0.2)]]
)
def test_a_repeated_texture_is_left_alone(uv: list[tuple[float, float]]) -> None:
    texture = np.zeros((50, 50, 3), np.uint8)
    coordinates = np.array(uv)
    same_uv, same = cut_texture(coordinates, np.array((0, 1, 2)), texture)
    assert same is texture
    assert same_uv is coordinates
