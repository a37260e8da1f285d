"""Motion blur has the length that geometry gives it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from camera_poses import level_pose
from hypothesis import given, settings
from hypothesis import strategies as st

from perception import Camera
from sim_tests.world.camera import motion_blur, motion_field, to_linear

CAMERA = Camera(120, 80, 110.0, 105.0, 58.7, 41.2)
STILL = level_pose((0.3, -0.4, 1.2), 0.7, 0.1)


def _moved(pose: np.ndarray, shift_camera_m: tuple[float, float, float]) -> np.ndarray:
    out = pose.copy()
    out[:3, 3] += pose[:3, :3] @ np.array(shift_camera_m)
    return out


def _edge() -> np.ndarray:
    image = np.full((80, 120, 3), 40, np.uint8)
    image[:, 60:] = 220
    return image


@settings(max_examples=40, deadline=None)
@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(0.5, 20.0))
def test_a_sideways_motion_moves_a_plane_by_f_d_over_z(dx: float, dy: float, z: float) -> None:
    depth = np.full((80, 120), z)
    field = motion_field(CAMERA, depth, STILL, _moved(STILL, (dx, dy, 0.0)))
    np.testing.assert_allclose(field[..., 0], -CAMERA.fx_px * dx / z, atol=1e-6)
    np.testing.assert_allclose(field[..., 1], -CAMERA.fy_px * dy / z, atol=1e-6)


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.floats(-0.2, 0.2)] * 3), st.floats(-0.05, 0.05), st.integers(0, 2**31))
def test_the_field_is_where_points_are_projected_to(
    shift: tuple[float, float, float], turn_rad: float, seed: int
) -> None:
    depth = np.random.default_rng(seed).uniform(1.0, 9.0, (80, 120))
    last = _moved(level_pose((0.3, -0.4, 1.2), 0.7 + turn_rad, 0.1), shift)
    field = motion_field(CAMERA, depth, STILL, last)
    for u, v in ((0, 0), (119, 79), (60, 30)):
        z = depth[v, u]
        ray = np.array([(u - CAMERA.cx_px) / CAMERA.fx_px, (v - CAMERA.cy_px) / CAMERA.fy_px, 1.0])
        odom = STILL[:3, :3] @ (ray * z) + STILL[:3, 3]
        end = CAMERA.project(((odom - last[:3, 3]) @ last[:3, :3])[None])[0]
        np.testing.assert_allclose(field[v, u], end - (u, v), atol=1e-6)


def test_far_away_only_turning_moves_the_image() -> None:
    nothing = np.full((80, 120), np.inf)
    moved = motion_field(CAMERA, nothing, STILL, _moved(STILL, (0.2, 0.1, 0.3)))
    assert np.abs(moved).max() < 1e-3
    turned = motion_field(CAMERA, nothing, STILL, level_pose((0.3, -0.4, 1.2), 0.71, 0.1))
    middle = turned[41, 59]
    assert middle[0] == pytest.approx(CAMERA.fx_px * 0.01, rel=0.02)  # to the left: content right


def test_only_the_actor_moves_by_its_own_velocity() -> None:
    depth = np.full((80, 120), 4.0)
    actors = np.full((80, 120), -1, np.int32)
    actors[20:60, 30:50] = 2
    pose = level_pose((0.0, 0.0, 1.2), 0.0)
    field = motion_field(CAMERA, depth, pose, pose, actors, {2: (0.0, 1.5), 7: (9.0, 9.0)}, 0.02)
    # Odom y is to the camera's left.
    np.testing.assert_allclose(field[actors == 2][:, 0], -CAMERA.fx_px * 1.5 * 0.02 / 4.0)
    np.testing.assert_allclose(field[actors == 2][:, 1], 0.0, atol=1e-9)
    np.testing.assert_allclose(field[actors != 2], 0.0, atol=1e-9)


@pytest.mark.parametrize("length_px", [3.0, 8.0, 15.0])
def test_an_edge_smears_evenly_over_its_path(length_px: float) -> None:
    """Light rises linearly over fx · d / z pixels around the edge, and is constant elsewhere."""
    z = 2.0
    shift = length_px * z / CAMERA.fx_px
    field = motion_field(CAMERA, np.full((80, 120), z), STILL, _moved(STILL, (shift, 0.0, 0.0)))
    light = to_linear(motion_blur(_edge(), field))[40, :, 0]
    low, high = to_linear(np.uint8([40, 220]))
    # The edge lies at 59.5, between the centres of the last dark and the first bright pixel.
    ramp = low + (high - low) * np.clip((np.arange(120) - 59.5) / length_px + 0.5, 0.0, 1.0)
    inside = np.abs(np.arange(120) - 59.5) < 0.5 * length_px - 0.5
    outside = np.abs(np.arange(120) - 59.5) > 0.5 * length_px + 1.0
    np.testing.assert_allclose(light[inside], ramp[inside], atol=0.03 * (high - low))
    np.testing.assert_allclose(light[outside], ramp[outside], atol=0.005)


def test_things_that_stand_still_stay_sharp() -> None:
    rng = np.random.default_rng(2)
    image = rng.integers(0, 256, (80, 120, 3)).astype(np.uint8)
    field = motion_field(CAMERA, rng.uniform(1.0, 9.0, (80, 120)), STILL, STILL)
    np.testing.assert_array_equal(motion_blur(image, field), image)
    # A moving actor does not change the scenery a few pixels away from it.
    actors = np.full((80, 120), -1, np.int32)
    actors[30:50, 40:60] = 0
    field[actors == 0] = (6.0, 0.0)
    out = motion_blur(image, field, actors)
    assert (out[30:50, 40:60] != image[30:50, 40:60]).any()
    far = np.ones((80, 120), dtype=bool)
    far[25:55, 33:67] = False
    np.testing.assert_array_equal(out[far], image[far])


def test_a_moving_outline_is_half_see_through() -> None:
    """A bright actor over a dark scene lights each pixel for the time that it covers it."""
    image = np.full((80, 120, 3), 30, np.uint8)
    actors = np.full((80, 120), -1, np.int32)
    actors[20:60, 40:80] = 1
    image[actors == 1] = 230
    field = np.zeros((80, 120, 2))
    field[actors == 1] = (10.0, 0.0)
    light = to_linear(motion_blur(image, field, actors))[40, :, 1]
    low, high = to_linear(np.uint8([30, 230]))
    for edge, sign in ((39.5, 1.0), (79.5, -1.0)):
        columns = np.arange(math.ceil(edge - 4.0), math.floor(edge + 4.0) + 1)
        share = 0.5 + sign * (columns - edge) / 10.0
        np.testing.assert_allclose(light[columns], low + share * (high - low), atol=0.03)
    assert light[60] == pytest.approx(high, abs=0.01)
