"""Depth images: the range along the ray at any place, and whose a surface is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from perception import Camera
from perception.depth_image import BEHIND_M, find_chest

CAMERA = Camera.from_fov(640, 480, math.radians(100.0))
TRUNK_M = np.array([[0.0, -0.15, 0.0], [0.0, 0.35, 0.0]])


def flat_person(u_px, range_m):
    """Return a ray (3,), and the depth (H, W) of a wall that faces it, as far as a chest."""
    ray = np.append(CAMERA.normalise([[u_px, CAMERA.cy_px]])[0], 1.0)
    direction = ray / np.linalg.norm(ray)
    rows, columns = np.mgrid[0 : CAMERA.height_px, 0 : CAMERA.width_px]
    x = (columns - CAMERA.cx_px) / CAMERA.fx_px
    y = (rows - CAMERA.cy_px) / CAMERA.fy_px
    along = x * direction[0] + y * direction[1] + direction[2]
    return direction, np.where(along > 0.1, (range_m - BEHIND_M) / np.maximum(along, 0.1), np.nan)


@settings(max_examples=30, deadline=None)
@given(st.floats(1.0, 638.0), st.floats(1.5, 6.0))
def test_the_range_is_right_at_any_side_of_the_picture(u_px, range_m):
    direction, depth = flat_person(u_px, range_m)
    trunk = CAMERA.project(direction * range_m + TRUNK_M)
    chest = find_chest(CAMERA, depth, direction, trunk, np.zeros((0, 2)), np.zeros(0))
    assert chest is not None
    assert chest.range_m == pytest.approx(range_m, abs=0.02)
    assert chest.keypoint_share is None


@settings(max_examples=30, deadline=None)
@given(st.floats(0.3, 0.85), st.integers(0, 4))
def test_keypoints_behind_an_occluder_say_that_it_is_not_the_person(nearer, hidden):
    """Four of the joints are beside it, and ``hidden`` ones on it."""
    direction, depth = flat_person(320.0, 5.0)
    trunk = CAMERA.project(direction * 5.0 + TRUNK_M)
    depth[:, :340] *= nearer
    joints = np.array([[400.0, 200.0 + 20.0 * n] for n in range(4)])
    joints = np.concatenate([joints, np.tile([[320.0, 240.0]], (hidden, 1))])
    chest = find_chest(CAMERA, depth, direction, trunk, joints, np.zeros(len(joints)))
    assert chest is not None
    assert chest.keypoint_share == pytest.approx(hidden / (4 + hidden))
