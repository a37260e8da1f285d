"""The head frame by the paper's printed formula."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic_people import person_at

from perception import Camera, PnpHeadPoseEstimator
from perception.anthropometry import HEAD_TEMPLATE_M, NECK_TO_NOSE_UP_M
from perception.head_frame import lifted_head_model, printed_head_rotation

NECK_HEAD_M = np.array([NECK_TO_NOSE_UP_M, -0.144, 0.0])


@given(st.integers(0, 2**31), st.floats(0.5, 2.0))
def test_the_frame_turns_with_the_head_and_is_right_handed(seed, scale):
    turn = Rotation.random(random_state=seed).as_matrix()
    points = scale * HEAD_TEMPLATE_M @ turn.T + [0.1, 0.2, 3.0]
    neck = scale * turn @ NECK_HEAD_M + [0.1, 0.2, 3.0]
    still = printed_head_rotation(HEAD_TEMPLATE_M, NECK_HEAD_M)
    np.testing.assert_allclose(printed_head_rotation(points, neck), turn @ still, atol=1e-9)
    np.testing.assert_allclose(still @ still.T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(np.cross(still[:, 1], still[:, 2]), still[:, 0], atol=1e-9)


def test_the_printed_formula_points_36_degrees_below_straight_ahead():
    gaze = printed_head_rotation(HEAD_TEMPLATE_M, NECK_HEAD_M)[:, 1]
    below = math.degrees(math.atan2(gaze[0], gaze[1]))
    assert below == pytest.approx(36.0, abs=0.5)
    assert gaze[2] == pytest.approx(0.0, abs=1e-12)


def test_z_points_from_the_left_ear_to_the_right_ear():
    rotation = printed_head_rotation(HEAD_TEMPLATE_M, NECK_HEAD_M)
    ears = HEAD_TEMPLATE_M[4] - HEAD_TEMPLATE_M[3]
    np.testing.assert_allclose(rotation[:, 2], ears / np.linalg.norm(ears), atol=1e-12)


def test_pnp_on_lifted_points_agrees_with_the_printed_formula():
    camera = Camera(1280, 960, 1100.0, 1100.0, 640.0, 480.0)
    person = person_at((0.0, 0.4, 2.5), body_yaw_rad=0.4, head_yaw_rad=-0.2)
    keypoints = person.keypoints(camera, 0.0, np.random.default_rng(0))
    (head,) = PnpHeadPoseEstimator(head_model="lifted").estimate(None, camera, (keypoints,))
    points = person.points_camera_m
    printed = printed_head_rotation(points[:5], points[5:7].mean(axis=0))
    np.testing.assert_allclose(head.rotation_camera_head, printed, atol=1e-4)
    model = lifted_head_model(points[:5], points[5:7].mean(axis=0))
    np.testing.assert_allclose(model[0], 0.0, atol=1e-12)
