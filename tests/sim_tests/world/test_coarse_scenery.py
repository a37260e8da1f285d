"""Coarse scenery: people are as in the full image, and depths and ids stay true."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from perception import Camera
from sim_tests import CameraRenderer, Scenario, SimError
from sim_tests.crossing import Stage
from sim_tests.world.camera import FINE_PX_PER_M, CoarseSceneryRenderer

CAMERA = Camera.from_fov(768, 480, math.radians(100.0))
DIVISOR = 3


@pytest.fixture(scope="module")
def stage() -> Iterator[Stage]:
    with Stage(Scenario.shipped("crossing_attentive"), np.zeros(1)) as stage:
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


def test_a_divisor_of_one_changes_nothing(stage: Stage):
    T = stage.amr.T_odom_camera
    full = CameraRenderer(stage.warehouse).render(CAMERA, T)
    view = CoarseSceneryRenderer(stage.warehouse, 1).render(CAMERA, T)
    np.testing.assert_array_equal(view.rgb, full.rgb)
    np.testing.assert_array_equal(view.depth_m, full.depth_m)


def test_blocks_that_do_not_fill_the_image_are_refused(stage: Stage):
    with pytest.raises(SimError, match="blocks of 7 pixels must fill the image, got 768 x 480"):
        CoarseSceneryRenderer(stage.warehouse, 7).render(CAMERA, stage.amr.T_odom_camera)
    with pytest.raises(SimError, match="divisor"):
        CoarseSceneryRenderer(stage.warehouse, 0)
    with pytest.raises(ValueError, match="scenery_divisor must divide"):
        Scenario.shipped("crossing_attentive").camera.model_validate(
            {"width_px": 640, "height_px": 480, "scenery_divisor": 7}
        )
