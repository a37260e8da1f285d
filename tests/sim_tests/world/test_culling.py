"""Culling leaves out only what the image cannot show."""

from __future__ import annotations

import math

import numpy as np
import pytest
from camera_poses import level_pose

from perception import Camera
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import WarehouseLayout
from sim_tests.world.render import _visuals


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
