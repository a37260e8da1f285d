"""The robot's visual actor: pose, turned wheels, and a free view for its own camera."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception import Camera
from sim_tests.actors.robot import (
    CAMERA_FORWARD_M,
    CAMERA_HEIGHT_M,
    NOVA_CARTER,
    Amr,
    RobotLook,
    amr_meshes,
)
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import WarehouseLayout


def test_no_part_of_it_is_in_view_of_its_camera() -> None:
    base = amr_meshes()["base_link"]
    ahead = base.vertices_m[:, 0] - CAMERA_FORWARD_M
    off_axis = np.abs(base.vertices_m[:, 2] - CAMERA_HEIGHT_M)
    # Parts ahead of the lens lie more than 45° below its axis.
    assert (off_axis[ahead > 0.0] > ahead[ahead > 0.0]).all()
    assert (ahead[off_axis < 0.3] < 0.0).all()


@pytest.mark.parametrize("heading_rad", [0.0, 2.5])
def test_it_is_drawn_where_the_robot_is_and_its_camera_does_not_see_it(heading_rad: float) -> None:
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        amr = Amr(warehouse, (2.0, 1.0), heading_rad)
        look = RobotLook.of(amr)
        number = warehouse.visuals.add_actor(look)
        for _ in range(60):
            amr.command(1.0, 0.5)
            amr.advance(warehouse.physics_dt_s)
            warehouse.step()
        renderer = CameraRenderer(warehouse)
        wide = Camera.from_fov(160, 120, math.radians(90.0))
        assert not (renderer.render(wide, amr.T_odom_camera).actors == number).any()
        above = np.eye(4)
        above[:3, :3] = np.diag([1.0, -1.0, -1.0])  # u along odom x, v against odom y
        above[:3, 3] = (*amr.T_odom_base[:2, 3], 4.0)
        camera = Camera(400, 400, 400.0, 400.0, 199.5, 199.5)
        view = renderer.render(camera, above)
        rows, columns = np.nonzero(view.actors == number)
        depth = view.depth_m[rows, columns]
        seen = np.stack(
            [(columns - 199.5) * depth / 400.0, -(rows - 199.5) * depth / 400.0, 4.0 - depth], -1
        )
        rotation = amr.T_odom_base[:3, :3]
        in_base = seen @ rotation
        outline = NOVA_CARTER.footprint_m
        assert (in_base[:, :2] > outline.min(axis=0) - 0.02).all()
        assert (in_base[:, :2] < outline.max(axis=0) + 0.02).all()
        # From above the cover is visible, which is 12 mm smaller all round; a pixel is 9 mm.
        np.testing.assert_allclose(np.ptp(in_base[:, :2], axis=0), (0.70, 0.476), atol=0.025)
        low, high = look.bounds_odom_m()
        world = seen + np.array([*amr.T_odom_base[:2, 3], 0.0])
        assert (world > low - 0.01).all()
        assert (world < high + 0.01).all()
