"""The floor as a range cue: exact depths for exact rays, and correct standard deviations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from perception import FloorPlane

LEVEL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # camera to odom


def pose(height_m=1.2, pitch_rad=0.0, roll_rad=0.0, yaw_rad=0.0):
    T = np.eye(4)
    turn = Rotation.from_euler("zyx", [yaw_rad, pitch_rad, roll_rad]).as_matrix()
    T[:3, :3] = turn @ LEVEL
    T[:3, 3] = (3.0, -2.0, height_m)
    return T


@given(
    pitch=st.floats(-0.3, 0.6), roll=st.floats(-0.3, 0.3), yaw=st.floats(-3.0, 3.0),
    ahead=st.floats(1.0, 12.0), left=st.floats(-3.0, 3.0), above=st.floats(0.0, 0.3),
)  # fmt: skip
def test_points_on_the_floor_are_found_at_their_depth(pitch, roll, yaw, ahead, left, above):
    T = pose(1.2, pitch, roll, yaw)
    floor = FloorPlane.from_pose(T)
    heading = np.array([math.cos(yaw), math.sin(yaw)])
    flat = T[:2, 3] + ahead * heading + left * np.array([-heading[1], heading[0]])
    point = np.linalg.inv(T) @ np.append(flat, [above, 1.0])
    assume(point[2] > 0.3)
    depth, std = floor.depth_of((point[:2] / point[2])[None], above, 0.0, 0.0)
    assert depth[0] == pytest.approx(point[2], rel=1e-9)
    assert std[0] > 0.0
    assert floor.normal_camera @ point[:3] + floor.height_m == pytest.approx(above, abs=1e-9)


def test_rays_at_the_horizon_and_points_above_the_camera_have_no_depth():
    floor = FloorPlane(np.array([0.0, -1.0, 0.0]), 1.0)
    depth, std = floor.depth_of(np.array([[0.0, 0.0], [0.0, -0.2], [0.1, 0.005]]), 0.0, 0.0, 0.0)
    assert np.isnan(depth).all()
    assert np.isnan(std).all()
    assert np.isnan(floor.depth_of(np.array([[0.0, 0.3]]), 1.4, 0.0, 0.0)[0]).all()


def test_the_standard_deviation_agrees_with_random_errors():
    floor = FloorPlane.from_pose(pose(1.1, 0.2), height_std_m=0.02, tilt_std_rad=0.01)
    ray, count = np.array([0.15, 0.12]), 40000
    rng = np.random.default_rng(0)
    turns = Rotation.from_rotvec(rng.normal(0.0, 0.01, (count, 3))).as_matrix()
    normals = turns @ floor.normal_camera
    rays = np.append(ray, 1.0) + np.column_stack(
        [rng.normal(0.0, 0.004, (count, 2)), np.zeros(count)]
    )
    heights = 1.1 + rng.normal(0.0, 0.02, count) - (0.07 + rng.normal(0.0, 0.03, count))
    drawn = np.log(heights / -np.einsum("ni,ni->n", normals, rays))
    depth, std = floor.depth_of(ray[None], 0.07, 0.03, 0.004)
    assert np.median(drawn) == pytest.approx(math.log(depth[0]), abs=0.005)
    assert std[0] == pytest.approx(drawn.std(), rel=0.1)
