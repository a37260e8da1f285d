"""Head pose networks: graphs whose results in the camera frame are known."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from onnx_graphs import DISC_M, disc_network, full_range_network
from scipy.spatial.transform import Rotation

from perception import Camera, PerceptionError, PersonKeypoints
from perception.anthropometry import HEAD_CENTRE_HEAD_M
from perception.networks import OnnxModel
from perception.networks.heads import OnnxHeadPoseEstimator, ray_axes

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
WIDE = Camera.from_fov(960, 600, math.radians(120.0))
FACING_HEAD = np.stack([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]], axis=1)


class Thorough(OnnxHeadPoseEstimator):
    """An estimator that cuts a crop up to three times, so that it is centred."""

    _passes = 3


class Quick(OnnxHeadPoseEstimator):
    """An estimator that cuts a crop once."""

    _passes = 1


def disc_image(camera, centre_camera_m):
    """Return an image of a white disc perpendicular to its ray, with an anti-aliased rim."""
    v, u = np.mgrid[: camera.height_px, : camera.width_px]
    rays = camera.normalise(np.column_stack([u.ravel(), v.ravel()]))
    (axes,) = ray_axes(centre_camera_m[None, :2] / centre_camera_m[2])
    turned = np.column_stack([rays, np.ones(len(rays))]) @ axes
    distance_m = np.linalg.norm(centre_camera_m)
    ahead = np.maximum(turned[:, 2], 1e-3)
    away = distance_m * np.hypot(turned[:, 0], turned[:, 1]) / ahead
    rim_px = (0.5 * DISC_M - away) * camera.fx_px / distance_m
    grey = np.round(255.0 * np.clip(rim_px + 0.5, 0.0, 1.0)).astype(np.uint8)
    return np.repeat(grey.reshape(camera.height_px, camera.width_px, 1), 3, axis=2)


def disc_at(centre_camera_m):
    centre_camera_m = np.asarray(centre_camera_m)
    return disc_image(CAMERA, centre_camera_m), CAMERA.project([centre_camera_m])[0]


def centre_of(head):
    return head.position_camera_m + head.rotation_camera_head @ HEAD_CENTRE_HEAD_M


def person_about(pixel, px_per_m, offset_px=(0.0, 0.0), scores=(1, 1, 1, 1, 1)):
    """Return a person whose keypoints place the head's centre near ``pixel``."""
    pixels = np.zeros((17, 2))
    down = np.array([0.0, 1.0])
    u = np.asarray(pixel) + offset_px
    pixels[0] = u + 0.045 * px_per_m * down
    for row, (across, below) in enumerate(
        [(0.03, 0.012), (-0.03, 0.012), (0.078, 0.033), (-0.078, 0.033)], start=1
    ):
        pixels[row] = u + px_per_m * np.array([across, below])
    for row, (across, below) in {
        5: (0.2, 0.243), 6: (-0.2, 0.243), 11: (0.12, 0.75), 12: (-0.12, 0.75),
        13: (0.12, 1.16), 14: (-0.12, 1.16), 15: (0.12, 1.58), 16: (-0.12, 1.58),
    }.items():  # fmt: skip
        pixels[row] = u + px_per_m * np.array([across, below])
    root = np.column_stack([(pixels - pixels[11:13].mean(axis=0)) / px_per_m, np.zeros(17)])
    score = np.zeros(17)
    score[:5] = scores
    score[[5, 6, 11, 12, 13, 14, 15, 16]] = 1.0
    return PersonKeypoints(pixels, root, score, "coco")


@pytest.mark.parametrize("centre_m", [(0.0, -0.2, 2.0), (1.2, -0.5, 3.0), (-1.5, 0.6, 4.0)])
@pytest.mark.parametrize("misplaced", [(0.0, 0.0), (0.25, -0.2)])
def test_position_and_rotation_are_those_in_the_camera_frame(centre_m, misplaced):
    rotation = FACING_HEAD @ Rotation.from_euler("x", 0.4).as_matrix()
    estimator = Thorough(disc_network(rotation))
    image, pixel = disc_at(np.array(centre_m))
    px_per_m = CAMERA.fx_px / centre_m[2]
    off = 0.4 * px_per_m * np.array(misplaced)
    (head,) = estimator.estimate(image, CAMERA, (person_about(pixel, px_per_m, off),))
    centre = centre_of(head)
    np.testing.assert_allclose(centre, centre_m, rtol=0.012, atol=0.004)
    ray = CAMERA.normalise([pixel])
    # A crop is not cut again if it is centred to 3 % of its side (0.4 m): less than 0.5°.
    expected = ray_axes(ray)[0] @ rotation
    turn = Rotation.from_matrix(head.rotation_camera_head @ expected.T).magnitude()
    assert turn < math.radians(0.5)
    assert head.range_relative_std == pytest.approx(0.05)
    a, b, c = 0.95, 0.9, 0.9
    assert head.face_seen == pytest.approx(a * b + a * c + b * c - 2 * a * b * c, abs=1e-6)


@pytest.mark.parametrize("azimuth_deg", [-48.0, 35.0, 50.0])
def test_a_head_at_the_side_of_a_wide_lens_is_placed_correctly(azimuth_deg):
    azimuth = math.radians(azimuth_deg)
    truth = 2.0 * np.array([math.sin(azimuth), -0.12, math.cos(azimuth)])
    rotation = FACING_HEAD @ Rotation.from_euler("x", 0.4).as_matrix()
    estimator = Thorough(disc_network(rotation))
    pixel = WIDE.project([truth])[0]
    person = person_about(pixel, WIDE.fx_px / truth[2])
    (head,) = estimator.estimate(disc_image(WIDE, truth), WIDE, (person,))
    centre = centre_of(head)
    # The distortion of a wide lens within the crop remains.
    assert np.linalg.norm(centre - truth) < 0.03 * np.linalg.norm(truth)
    expected = ray_axes(WIDE.normalise([pixel]))[0] @ rotation
    turn = Rotation.from_matrix(head.rotation_camera_head @ expected.T).magnitude()
    assert turn < math.radians(0.7)


def test_the_covariance_agrees_with_random_errors():
    """Random errors of rotation, distance and centre move the nose."""
    rotation = FACING_HEAD
    estimator = OnnxHeadPoseEstimator(disc_network(rotation, rotation_std=0.05, side_log_std=0.03))
    truth = np.array([0.8, -0.3, 2.5])
    image, pixel = disc_at(truth)
    (head,) = estimator.estimate(image, CAMERA, (person_about(pixel, CAMERA.fx_px / 2.5),))
    rng = np.random.default_rng(0)
    count = 20000
    floor = math.radians(0.5)
    turns = rng.normal(0.0, math.hypot(0.05, floor), (count, 3))
    centre = centre_of(head)
    side_m = DISC_M * 64 / (DISC_M * CAMERA.fx_px / 2.5) * (0.4 * CAMERA.fx_px / 2.5) / 64
    scale = rng.normal(0.0, 0.03, (count, 1))
    centres = centre * (1.0 + scale) + rng.normal(0.0, 0.01 * side_m, (count, 3))
    turned = Rotation.from_rotvec(turns).as_matrix() @ head.rotation_camera_head
    noses = centres - turned @ HEAD_CENTRE_HEAD_M
    drawn = np.cov(np.hstack([turns, noses]).T)
    scale = np.sqrt(np.outer(np.diag(drawn), np.diag(drawn)))
    np.testing.assert_allclose(head.covariance / scale, drawn / scale, atol=0.05)


def test_what_two_passes_see_differently_joins_the_covariance(monkeypatch):
    """Both passes err independently by 0.1 rad, of which the network knows nothing."""
    rotation_std, error_std, rng = 0.02, 0.1, np.random.default_rng(5)
    estimator = OnnxHeadPoseEstimator(disc_network(FACING_HEAD, rotation_std=rotation_std))
    run, runs = estimator._run, []

    def with_error(pictures):
        rows = run(pictures)
        wrong = Rotation.from_rotvec(rng.normal(0.0, error_std, 3)).as_matrix()
        rows[0, :9] = (wrong @ rows[0, :9].reshape(3, 3)).ravel()
        runs.append(rows)
        return rows

    monkeypatch.setattr(estimator, "_run", with_error)
    truth = np.array([0.8, -0.3, 2.5])
    image, pixel = disc_at(truth)
    px_per_m = CAMERA.fx_px / 2.5
    once, twice = person_about(pixel, px_per_m), person_about(pixel, px_per_m, (9.0, 0.0))
    covariances = []
    for _ in range(150):
        runs.clear()
        (head,) = estimator.estimate(image, CAMERA, (twice,))
        assert len(runs) == 2
        covariances.append(head.covariance[:3, :3])
    known = rotation_std**2 + math.radians(0.5) ** 2
    expected = (known + error_std**2) * np.eye(3)
    # A standard deviation of √2 relative to the mean, of 150 samples: 12 %.
    np.testing.assert_allclose(np.mean(covariances, axis=0), expected, atol=0.4 * error_std**2)
    runs.clear()
    (head,) = estimator.estimate(image, CAMERA, (once,))
    assert len(runs) == 1
    np.testing.assert_allclose(head.covariance[:3, :3], known * np.eye(3), atol=1e-9)


def test_blur_makes_the_direction_less_certain_and_nothing_else():
    estimator = Quick(disc_network(FACING_HEAD, rotation_std=0.05))
    # The network does not see a chequered scenery, which has the detail of a head.
    image, pixel = disc_at(np.array([0.1, -0.2, 2.5]))
    v, u = np.mgrid[: CAMERA.height_px, : CAMERA.width_px]
    image = np.where(image > 0, image, 40 * ((u // 5 + v // 5) % 2)[..., None]).astype(np.uint8)
    person = person_about(pixel, CAMERA.fx_px / 2.5)
    (sharp,) = estimator.estimate(image, CAMERA, (person,))
    (blurred,) = estimator.estimate(cv2.blur(image, (17, 1)), CAMERA, (person,))
    ratio = blurred.covariance[0, 0] / sharp.covariance[0, 0]
    assert ratio > 1.3
    turns = blurred.covariance[:3, :3] - math.radians(0.5) ** 2 * np.eye(3)
    assert turns[0, 0] > 0.05**2
    np.testing.assert_allclose(turns, turns[0, 0] * np.eye(3), atol=1e-9)
    assert blurred.range_relative_std == sharp.range_relative_std


def test_head_poses_are_in_the_order_of_the_people_for_any_batch_size():
    truths = [np.array([-0.9, -0.2, 2.5]), np.array([0.9, -0.1, 3.5])]
    images, pixels = zip(*(disc_at(truth) for truth in truths), strict=True)
    image = np.maximum(*images)
    people = tuple(
        person_about(pixel, CAMERA.fx_px / truth[2])
        for pixel, truth in zip(pixels, truths, strict=True)
    )
    unseen = PersonKeypoints(np.zeros((17, 2)), np.zeros((17, 3)), np.zeros(17), "coco")
    for batch in ("N", 1, 3):
        estimator = OnnxHeadPoseEstimator(disc_network(FACING_HEAD, batch=batch))
        left, none, right = estimator.estimate(image, CAMERA, (people[0], unseen, people[1]))
        assert none is None
        assert left.position_camera_m[2] == pytest.approx(2.5 - 0.09, rel=0.03)
        assert right.position_camera_m[2] == pytest.approx(3.5 - 0.09, rel=0.03)


@pytest.mark.parametrize("scores", [(1, 1, 0, 1, 0), (0, 0, 0, 0, 0), (0, 0, 0, 0, 1)])
def test_a_head_is_found_from_any_seen_keypoints(scores):
    truth = np.array([0.3, -0.4, 3.0])
    image, pixel = disc_at(truth)
    person = person_about(pixel, CAMERA.fx_px / 3.0, scores=scores)
    (head,) = Thorough(disc_network(FACING_HEAD)).estimate(image, CAMERA, (person,))
    centre = centre_of(head)
    np.testing.assert_allclose(centre, truth, rtol=0.02, atol=0.01)


# --- no head, and refusals ----------------------------------------------------------------------


def test_crops_without_a_head_heads_outside_the_image_and_tiny_heads_have_no_pose():
    image, pixel = disc_at(np.array([0.0, 0.0, 2.0]))
    people = (person_about(pixel, CAMERA.fx_px / 2.0),)
    assert OnnxHeadPoseEstimator(disc_network(head=0.3)).estimate(image, CAMERA, people) == (None,)
    estimator = OnnxHeadPoseEstimator(disc_network())
    image = np.zeros((480, 640, 3), np.uint8)
    assert estimator.estimate(image, CAMERA, ()) == ()
    far_off = person_about((5000.0, -900.0), 200.0)
    tiny = person_about((300.0, 200.0), 10.0)
    assert estimator.estimate(image, CAMERA, (far_off, tiny)) == (None, None)


def test_non_finite_outputs_and_matrices_that_are_not_rotations_are_refused():
    image, pixel = disc_at(np.array([0.0, 0.0, 2.0]))
    estimator = OnnxHeadPoseEstimator(disc_network(side_log_std=np.nan))
    with pytest.raises(PerceptionError, match="side_log_std"):
        estimator.estimate(image, CAMERA, (person_about(pixel, 277.0),))
    squashed = OnnxHeadPoseEstimator(disc_network(0.3 * np.eye(3)))
    with pytest.raises(PerceptionError, match="not rotations"):
        squashed.estimate(image, CAMERA, (person_about(pixel, 277.0),))


def test_unknown_layouts_are_refused_with_what_is_known():
    unknown = full_range_network(np.zeros(5))
    with pytest.raises(PerceptionError, match=r"found image .* known are awarenav"):
        OnnxHeadPoseEstimator(unknown)
    with pytest.raises(PerceptionError, match="6DRepNet"):
        OnnxHeadPoseEstimator(full_range_network(np.eye(3), size=96))
    with pytest.raises(PerceptionError, match="layout 2"):
        OnnxHeadPoseEstimator(disc_network(metadata={"awarenav_layout": "2"}))
    with pytest.raises(PerceptionError, match="'mean' must be a number"):
        OnnxHeadPoseEstimator(disc_network(metadata={"mean": "grey"}))
    assert OnnxHeadPoseEstimator(OnnxModel(disc_network())).layout.is_awarenav


# --- networks of the 6DRepNet kind ---------------------------------------------------------------


def angles_300w_lp(yaw, pitch, roll):
    """Return the matrix of these networks: Rz(roll) Ry(yaw) Rx(pitch)."""
    return Rotation.from_euler("xyz", [pitch, yaw, roll]).as_matrix()


@given(yaw=st.floats(-3.1, 3.1), pitch=st.floats(-1.0, 1.0), roll=st.floats(-1.0, 1.0))
@settings(max_examples=20, deadline=None)
def test_rotations_of_full_range_networks_agree_with_the_axes_that_6drepnet_draws(yaw, pitch, roll):
    """In the middle of the image, 6DRepNet's code draws these axes, x right and y down.

    The face's forward axis points to (sin(−yaw), −cos(yaw) sin(pitch)), the axis to the person's
    left to (cos(yaw) cos(roll), cos(pitch) sin(roll) + cos(roll) sin(pitch) sin(−yaw)).
    """
    matrix = angles_300w_lp(yaw, pitch, roll)
    (rotation,) = rotations_of(matrix)
    forward, left = rotation[:, 1], -rotation[:, 2]
    np.testing.assert_allclose(
        forward[:2], [-math.sin(yaw), -math.cos(yaw) * math.sin(pitch)], atol=1e-4
    )
    drawn = math.cos(pitch) * math.sin(roll) - math.cos(roll) * math.sin(pitch) * math.sin(yaw)
    np.testing.assert_allclose(left[:2], [math.cos(yaw) * math.cos(roll), drawn], atol=1e-4)
    # A face with angles of 0 looks at the camera.
    assert forward[2] == pytest.approx(-math.cos(yaw) * math.cos(pitch), abs=1e-4)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def rotations_of(*outputs):
    estimator = OnnxHeadPoseEstimator(full_range_network(outputs[0]))
    image = np.zeros((480, 640, 3), np.uint8)
    person = person_about((320.0, 240.0), 200.0)
    (head,) = estimator.estimate(image, CAMERA, (person,))
    return (head.rotation_camera_head,)


def test_six_numbers_give_the_same_rotation_as_the_matrix():
    matrix = angles_300w_lp(0.7, -0.2, 0.1)
    six = np.concatenate([2.5 * matrix[:, 0], matrix[:, 1] + 0.3 * matrix[:, 0]])
    np.testing.assert_allclose(rotations_of(six)[0], rotations_of(matrix)[0], atol=1e-5)
    with pytest.raises(PerceptionError, match="span no rotation"):
        rotations_of(np.ones(6))


def test_a_full_range_network_gives_no_range_and_no_visibility():
    estimator = OnnxHeadPoseEstimator(full_range_network(np.eye(3)))
    person = person_about((320.0, 240.0), 200.0)
    (head,) = estimator.estimate(np.zeros((480, 640, 3), np.uint8), CAMERA, (person,))
    assert head.face_seen is None
    assert head.range_relative_std is None
    assert head.gaze_camera[2] < -0.99
    std = np.sqrt(np.diag(head.covariance))
    assert np.allclose(std[:3], math.radians(10.0), rtol=0.01)
    assert head.position_camera_m[2] == pytest.approx(CAMERA.fx_px / 200.0 - 0.09, rel=0.1)
