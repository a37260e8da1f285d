"""Accuracy and covariance of PnP head poses, for heads in all directions."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2
from synthetic_people import person_at

from perception import AttentionCone, Camera, PersonKeypoints, PnpHeadPoseEstimator
from perception.anthropometry import HEAD_TEMPLATE_M
from perception.awareness import estimate_awareness

CAMERA = Camera(1280, 960, 1100.0, 1100.0, 640.0, 480.0)
EAR_TO_NOSE_M = 0.1107


def awareness_of(cone, head, robot):
    """Return α and its standard deviation, for eyes that look where the head points."""
    (found,) = estimate_awareness(
        cone,
        (head,),
        robot,
        extra_std_rad=np.zeros(1),
        eye_in_head_std_rad=(0.0, 0.0),
        face_seen=np.ones(1),
    )
    return found.awareness, found.awareness_std


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


def gaze_errors_deg(noise_px, count, seed, **options):
    rng = np.random.default_rng(seed)
    truth = [turned_head(rng, yaw) for yaw in rng.uniform(-math.pi, math.pi, count)]
    people = tuple(head_only(*pose, noise_px, rng) for pose in truth)
    heads = PnpHeadPoseEstimator(**options).estimate(None, CAMERA, people)
    assert all(head is not None for head in heads)
    return np.degrees(
        [
            math.acos(np.clip(head.gaze_camera @ rotation[:, 1], -1.0, 1.0))
            for head, (rotation, _) in zip(heads, truth, strict=True)
        ]
    ), [(head, pose) for head, pose in zip(heads, truth, strict=True)]


def test_without_noise_the_pose_is_exact():
    errors, pairs = gaze_errors_deg(1e-6, 100, 0)
    assert errors.max() < 1e-3
    for head, (_, position) in pairs:
        np.testing.assert_allclose(head.position_camera_m, position, atol=1e-4)


@pytest.mark.parametrize(("noise_px", "median_deg"), [(1.0, 2.0), (2.0, 3.5)])
def test_the_gaze_error_in_all_directions(noise_px, median_deg):
    errors, _ = gaze_errors_deg(noise_px, 500, 1)
    assert np.median(errors) <= median_deg
    if noise_px == 1.0:
        assert errors.max() < 90.0


def test_covariance_is_consistent_with_the_errors_of_heads_of_a_known_shape():
    _, pairs = gaze_errors_deg(1.0, 800, 2, head_shape_spread=0.0)
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
    robot, cone = np.zeros((1, 3)), AttentionCone()
    estimator = PnpHeadPoseEstimator(head_shape_spread=0.0)
    people = tuple(person.keypoints(CAMERA, 1.0, rng) for _ in range(400))
    heads = estimator.estimate(None, CAMERA, people)
    drawn = np.array([awareness_of(cone, head, robot)[0] for head in heads])
    (nominal,) = estimator.estimate(None, CAMERA, (person.keypoints(CAMERA, 0.0, rng),))
    alpha, std = awareness_of(cone, nominal, robot)
    truth = cone.score(person.eyes_camera_m, person.rotation_camera_head[:, 1], np.zeros(3))
    assert alpha == pytest.approx(truth, abs=0.01)
    assert std == pytest.approx(drawn.std(), rel=0.25)


@pytest.mark.parametrize(
    ("head_yaw_deg", "seen", "tolerance_deg"),
    [
        (90, (1, 1, 0, 1, 0), 15),  # left profile: nose, near eye, near ear
        (-90, (1, 0, 1, 0, 1), 15),
        (60, (1, 1, 1, 1, 0), 10),
        (180, (0, 0, 0, 1, 1), 50),  # back of the head: ears only
        (150, (0, 0, 0, 1, 1), 60),
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
    robot = np.zeros((1, 3))
    for head in heads:
        if head is not None and abs(head_yaw_deg) >= 90:
            alpha, std = awareness_of(AttentionCone(), head, robot)
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
