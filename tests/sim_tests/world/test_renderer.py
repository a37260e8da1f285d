"""Rendered images and depth fall where the camera model projects the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from camera_poses import level_pose, pixel_rays
from visual_actors import ball

from perception import Camera
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer

OFF_CENTRE = Camera(320, 240, 270.0, 260.0, 171.3, 110.6)


@pytest.fixture(scope="module")
def renderer(hall: Warehouse) -> CameraRenderer:
    return CameraRenderer(hall)


def test_a_ball_appears_where_it_is_projected(renderer, add_actor) -> None:
    actor = ball(colour=(1.0, 0.0, 0.0))
    number = add_actor(actor)
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(24):
        T = level_pose((0.0, 0.0, 1.4), rng.uniform(-3.0, 3.0), rng.uniform(-0.2, 0.3))
        camera_m = np.array([rng.uniform(-0.8, 0.8), rng.uniform(-0.6, 0.6), rng.uniform(2.0, 3.5)])
        actor.position_m = T[:3, :3] @ camera_m + T[:3, 3]
        view = renderer.render(OFF_CENTRE, T)
        rows, columns = np.nonzero(view.actors == number)
        assert len(rows) > 50
        centroid = np.array([columns.mean(), rows.mean()])
        errors.append(centroid - OFF_CENTRE.project(camera_m[None])[0])
        front = view.depth_m[rows, columns].min()
        assert front == pytest.approx(camera_m[2] - 0.06, abs=0.003)  # the ball has facets
        np.testing.assert_array_equal(view.actors == number, view.body_ids == actor.body)
    # One ball's centroid depends on which pixels its edge takes; all together show any offset.
    assert np.abs(np.mean(errors, axis=0)).max() < 0.06
    assert np.linalg.norm(errors, axis=1).max() < 0.2


@pytest.mark.parametrize("pitch_rad", [0.35, 1.2])
def test_depth_of_the_floor_is_exact(renderer: CameraRenderer, pitch_rad: float) -> None:
    T = level_pose((0.0, 0.0, 1.4), 0.3, pitch_rad)
    view = renderer.render(OFF_CENTRE, T)
    rays = pixel_rays(OFF_CENTRE)
    falls = rays @ T[2, :3]  # change of odom z per metre of depth
    expected = np.where(falls < 0.0, -1.4 / falls, np.inf)
    near = expected < 3.5  # farther away the racks and walls begin
    assert near.sum() > 10_000
    # Paint lies up to 4 mm above the floor.
    np.testing.assert_allclose(view.depth_m[near], expected[near], rtol=4e-3)


def test_a_rectangle_is_that_part_of_the_whole(renderer, add_actor) -> None:
    add_actor(ball(position_m=(2.0, 0.1, 1.5)))
    T = level_pose((0.0, 0.0, 1.4), 0.0)
    whole = renderer.render(OFF_CENTRE, T)
    for u0, v0, u1, v1 in ((100, 40, 220, 200), (0, 0, 77, 33), (159, 100, 160, 101)):
        part = renderer.render(OFF_CENTRE, T, (u0, v0, u1, v1))
        assert part.rgb.shape == (v1 - v0, u1 - u0, 3)
        same = part.body_ids == whole.body_ids[v0:v1, u0:u1]
        # A sample on the very edge of a triangle may round to either side.
        assert same.mean() > 0.995
        close = np.isclose(part.depth_m, whole.depth_m[v0:v1, u0:u1], rtol=2e-3)
        assert close[same].mean() > 0.998


@pytest.mark.parametrize("heading_deg", [90.0, -90.0])
def test_corners_in_the_cameras_plane_do_no_harm(renderer, heading_deg) -> None:
    """The floor's tiles meet at y = 0 under the camera: its image equals one from 1 cm beside."""
    camera = Camera.from_fov(160, 160, math.radians(110.0))
    at, beside = (
        renderer.render(camera, level_pose((0.12, y_m, 1.55), math.radians(heading_deg)))
        for y_m in (0.0, 0.01)
    )
    different = np.abs(at.rgb.astype(int) - beside.rgb).max(axis=2) > 40
    assert different.mean() < 0.03
    np.testing.assert_allclose(at.depth_m[120:], beside.depth_m[120:], rtol=0.03)


@pytest.mark.parametrize("factor", [2, 3])
def test_supersampling_averages_the_finer_image(hall: Warehouse, factor: int) -> None:
    T = level_pose((0.0, 0.0, 1.4), 0.4)
    smooth = CameraRenderer(hall, supersampling=factor).render(OFF_CENTRE, T)
    once = CameraRenderer(hall)
    fine = once.render(OFF_CENTRE, T, (0, 0, 320, 240), (320 * factor, 240 * factor))
    mean = fine.rgb.reshape(240, factor, 320, factor, 3).astype(float).mean(axis=(1, 3))
    np.testing.assert_allclose(smooth.rgb, mean, atol=0.51)
    middle = factor // 2
    np.testing.assert_array_equal(smooth.depth_m, fine.depth_m[middle::factor, middle::factor])
    np.testing.assert_array_equal(smooth.body_ids, fine.body_ids[middle::factor, middle::factor])
    if factor % 2:  # an odd grid has a sample at the pixel's centre
        plain = once.render(OFF_CENTRE, T)
        same = smooth.body_ids == plain.body_ids
        assert same.mean() > 0.995
        np.testing.assert_allclose(smooth.depth_m[same], plain.depth_m[same], rtol=2e-3)
