"""PnP head poses: accuracy, covariance, and the head frame of the paper's printed formula."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import chi2
from synthetic_people import KnownShape, awareness_of, person_at

from perception import AttentionCone, Camera, PersonKeypoints, PnpHeadPoseEstimator
from perception.anthropometry import HEAD_TEMPLATE_M, NECK_TO_NOSE_UP_M
from perception.head_frame import lifted_head_model, printed_head_rotation

CAMERA = Camera(1280, 960, 1100.0, 1100.0, 640.0, 480.0)
EAR_TO_NOSE_M = 0.1107


def turned_head(rng, yaw_rad, ear_to_nose_px=55.0):
    """Return rotation and position of a head with this distance from ear midpoint to nose."""
    facing = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    angles = [yaw_rad, rng.uniform(-0.4, 0.4), rng.normal(0.0, 0.1)]
    rotation = facing @ Rotation.from_euler("xzy", angles).as_matrix()
    depth = CAMERA.fx_px * EAR_TO_NOSE_M / ear_to_nose_px
    return rotation, depth * np.array([rng.uniform(-0.3, 0.3), rng.uniform(-0.2, 0.2), 1.0])


def head_only(rotation, position, noise_px, rng, seen=(1, 1, 1, 1, 1)):
    pixels, scores = np.zeros((17, 2)), np.zeros(17)
    pixels[:5] = CAMERA.project(HEAD_TEMPLATE_M @ rotation.T + position)
    pixels[:5] += rng.normal(0.0, noise_px, (5, 2))
    scores[:5] = seen
    return PersonKeypoints(pixels, np.zeros((17, 3)), scores, "coco")


def gaze_errors_deg(noise_px, count, seed, estimator=None):
    rng = np.random.default_rng(seed)
    truth = [turned_head(rng, yaw) for yaw in rng.uniform(-math.pi, math.pi, count)]
    people = tuple(head_only(*pose, noise_px, rng) for pose in truth)
    heads = (estimator or PnpHeadPoseEstimator()).estimate(None, CAMERA, people)
    assert all(head is not None for head in heads)
    return np.degrees(
        [
            math.acos(np.clip(head.gaze_camera @ rotation[:, 1], -1.0, 1.0))
            for head, (rotation, _) in zip(heads, truth, strict=True)
        ]
    ), list(zip(heads, truth, strict=True))


def test_without_noise_the_pose_is_exact():
    errors, pairs = gaze_errors_deg(1e-6, 100, 0)
    assert errors.max() < 1e-3
    for head, (_, position) in pairs:
        np.testing.assert_allclose(head.position_camera_m, position, atol=1e-4)


@pytest.mark.parametrize(
    ("noise_px", "median_deg", "most_deg"), [(1.0, 2.0, 90.0), (2.0, 3.5, 181)]
)
def test_the_gaze_error_in_all_directions(noise_px, median_deg, most_deg):
    errors, _ = gaze_errors_deg(noise_px, 250, 1)
    assert np.median(errors) <= median_deg
    assert errors.max() < most_deg


def test_covariance_is_consistent_with_the_errors_of_heads_of_a_known_shape():
    _, pairs = gaze_errors_deg(1.0, 400, 2, KnownShape())
    nees = []
    for head, (rotation, position) in pairs:
        turn = Rotation.from_matrix(rotation @ head.rotation_camera_head.T).as_rotvec()
        error = np.concatenate([turn, position - head.position_camera_m])
        nees.append(error @ np.linalg.solve(head.covariance, error))
    low, high = chi2.ppf([0.025, 0.975], 6 * len(nees)) / len(nees)
    assert low <= np.mean(nees) <= high


@pytest.mark.parametrize("yaw_deg", [5, 34, 55])
def test_the_standard_deviation_of_awareness_agrees_with_monte_carlo(yaw_deg):
    """It agrees within 25 % in the middle, on the flank and at the edge of the cone.

    All heads have the template's shape, and the estimator knows it.
    """
    rng = np.random.default_rng(4)
    person = person_at((0.2, 0.3, 2.5), body_yaw_rad=0.3, head_yaw_rad=math.radians(yaw_deg) - 0.3)
    estimator = KnownShape()
    people = tuple(person.keypoints(CAMERA, 1.0, rng) for _ in range(200))
    heads = estimator.estimate(None, CAMERA, people)
    drawn = np.array([awareness_of(head)[0] for head in heads])
    (nominal,) = estimator.estimate(None, CAMERA, (person.keypoints(CAMERA, 0.0, rng),))
    alpha, std = awareness_of(nominal)
    truth = AttentionCone().score(
        person.eyes_camera_m, person.rotation_camera_head[:, 1], np.zeros(3)
    )
    assert alpha == pytest.approx(truth, abs=0.01)
    assert std == pytest.approx(drawn.std(), rel=0.25)


@pytest.mark.parametrize(
    ("head_yaw_deg", "seen", "tolerance_deg"),
    [
        (90, (1, 1, 0, 1, 0), 15),  # left profile: nose, near eye, near ear
        (60, (1, 1, 1, 1, 0), 10),
        (180, (0, 0, 0, 1, 1), 50),  # back of the head: ears only
    ],
)
def test_turned_heads_with_some_keypoints_hidden(head_yaw_deg, seen, tolerance_deg):
    """Yaw 0 faces the camera; the body is turned half as far as the head."""
    rng = np.random.default_rng(5)
    yaw = math.radians(head_yaw_deg)
    # A head that turns left shows the camera its right side; the minus turns it to the right.
    person = person_at((0.1, 0.4, 3.0), body_yaw_rad=-0.5 * yaw, head_yaw_rad=-0.5 * yaw)
    visible = np.concatenate([np.array(seen), np.ones(12)]).astype(bool)
    people = tuple(
        person.keypoints(CAMERA, 1.0, rng, lift_std_m=0.045, seen=visible) for _ in range(60)
    )
    heads = PnpHeadPoseEstimator().estimate(None, CAMERA, people)
    truth = person.rotation_camera_head[:, 1]
    errors = [
        math.degrees(math.acos(np.clip(head.gaze_camera @ truth, -1, 1)))
        for head in heads
        if head is not None
    ]
    assert len(errors) >= 55
    assert np.median(errors) < tolerance_deg
    for head in heads:
        if head is not None and abs(head_yaw_deg) >= 90:
            alpha, std = awareness_of(head)
            assert alpha - 1.28 * std < 0.2, "a face turned away was called aware"


def test_heads_without_enough_keypoints_have_no_pose():
    rng = np.random.default_rng(6)
    rotation, position = turned_head(rng, 0.3)
    far = position * 60.0
    unseen = head_only(rotation, position, 0.0, rng, seen=(0, 0, 0, 0, 0))
    nose_alone = head_only(rotation, position, 0.0, rng, seen=(1, 0, 0, 0, 0))
    too_small = head_only(rotation, far, 0.3, rng)
    one_point = PersonKeypoints(np.full((17, 2), 300.0), np.zeros((17, 3)), np.ones(17), "coco")
    people = (unseen, nose_alone, too_small, one_point)
    assert PnpHeadPoseEstimator().estimate(None, CAMERA, people) == (None,) * 4


def test_distorted_images_give_the_same_pose():
    rng = np.random.default_rng(7)
    distorted = Camera(1280, 960, 1100.0, 1100.0, 640.0, 480.0, [-0.2, 0.05, 0.001, 0.001, 0.0])
    rotation, position = turned_head(rng, 0.5)
    pixels, scores = np.zeros((17, 2)), np.zeros(17)
    pixels[:5] = distorted.project(HEAD_TEMPLATE_M @ rotation.T + position)
    scores[:5] = 1.0
    person = PersonKeypoints(pixels, np.zeros((17, 3)), scores, "coco")
    (head,) = PnpHeadPoseEstimator().estimate(None, distorted, (person,))
    np.testing.assert_allclose(head.rotation_camera_head, rotation, atol=1e-3)


# --- printed formula ------------------------------------------------------------------------------


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
    _, gaze, right = printed_head_rotation(HEAD_TEMPLATE_M, NECK_HEAD_M).T
    below = math.degrees(math.atan2(gaze[0], gaze[1]))
    assert below == pytest.approx(36.0, abs=0.5)
    assert gaze[2] == pytest.approx(0.0, abs=1e-12)
    assert right == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


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
