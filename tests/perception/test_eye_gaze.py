"""Eyes in the head: geometry of irises, fusion with the prior, and what it does to α."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic_people import FACING, awareness_of

from perception import AttentionCone, Camera, HeadPose
from perception.anthropometry import EYES_HEAD_M
from perception.eyes import (
    AHEAD_M,
    AHEAD_STD_M,
    ARM_RELATIVE_STD,
    IRIS_ARM_M,
    EyeGaze,
    eyes_from_irises,
    fuse_with_prior,
    known_eyes,
)
from perception.networks.heads import looking_at

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
CONE = AttentionCone()
PRIOR = (math.radians(7.0), math.radians(3.4))
NO_ERROR = np.diag([1e-12] * 6)
angle = st.floats(-0.4, 0.4)


def head_at(yaw=0.0, pitch=0.0, roll=0.0, eyes_at=(0.0, 0.0, 1.5), covariance=NO_ERROR):
    """Return a head with the midpoint of its eyes at a place; without angles it faces along −z."""
    turn = Rotation.from_euler("xzy", [-yaw, pitch, roll]).as_matrix()
    rotation = FACING @ turn
    return HeadPose(np.array(eyes_at) - rotation @ EYES_HEAD_M, rotation, covariance, 0.0)


def gaze_in_head(yaw, pitch):
    """Return the direction by its definition: left is −z, up is −x, forward is y."""
    return np.array(
        [-math.sin(pitch), math.cos(pitch) * math.cos(yaw), -math.cos(pitch) * math.sin(yaw)]
    )


def synthetic_offset(head, axes, yaw, pitch, *, arm=IRIS_ARM_M, ahead=AHEAD_M):
    """Return the mean offset of the irises of two eyeballs, and of an error-free mesh."""
    rotation = head.rotation_camera_head
    offsets = []
    for aside in (-0.03, 0.03):
        ball = head.position_camera_m + rotation @ np.add(EYES_HEAD_M, [0.0, 0.0, aside])
        iris = ball + rotation @ (arm * gaze_in_head(yaw, pitch))
        # The eye looks straight ahead with its iris this far from the midpoint of the corners.
        corners = ball + rotation @ (np.array([0.0, arm, 0.0]) - [*ahead, 0.0])
        offsets.append((axes.T @ (iris - corners))[:2])
    return np.mean(offsets, axis=0)


def ray_axes_of(head):
    eyes = head.position_camera_m + head.rotation_camera_head @ EYES_HEAD_M
    return looking_at(CAMERA, CAMERA.project(eyes[None]))[0][0]


@given(angle, angle, angle, angle, angle, st.floats(-0.3, 0.3), st.floats(0.8, 3.0))
def test_eyeballs_give_their_angles_exactly(
    head_yaw, head_pitch, roll, yaw, pitch, aside, distance
):
    head = head_at(head_yaw, head_pitch, roll, (aside * distance, 0.1, distance))
    axes = ray_axes_of(head)
    offset = synthetic_offset(head, axes, yaw, pitch)
    found = eyes_from_irises(offset, axes, head, iris_std_m=(5e-4, 1e-3))
    towards = (axes.T @ head.rotation_camera_head @ gaze_in_head(yaw, pitch))[2]
    if found is None:
        # The iris is near the rim of the eyeball.
        assert towards > -0.2
        return
    if towards < -1e-6:
        assert found.angles_rad == pytest.approx([yaw, pitch], abs=1e-6)
        assert found.rotation_head_eyes[:, 1] == pytest.approx(gaze_in_head(yaw, pitch), abs=1e-6)


@pytest.mark.parametrize("head_yaw", [0.0, 0.35, -0.6])
def test_the_covariance_is_that_of_repeated_measurements(head_yaw):
    rng = np.random.default_rng(5)
    std_m, yaw, pitch = (5e-4, 4e-4), 0.1, -0.05
    spread = np.diag([0.04**2, 0.05**2, 0.03**2, 1e-12, 1e-12, 1e-12])
    head = head_at(head_yaw, 0.1, covariance=spread)
    axes = ray_axes_of(head)
    found = eyes_from_irises(synthetic_offset(head, axes, yaw, pitch), axes, head, iris_std_m=std_m)
    errors = []
    for _ in range(600):
        turn = Rotation.from_rotvec(rng.multivariate_normal(np.zeros(3), spread[:3, :3]))
        true = turn.as_matrix() @ head.rotation_camera_head
        moved = HeadPose(head.position_camera_m, true, NO_ERROR, 0.0)
        offset = synthetic_offset(
            moved,
            axes,
            yaw,
            pitch,
            arm=IRIS_ARM_M * (1.0 + ARM_RELATIVE_STD * rng.normal()),
            ahead=AHEAD_M + AHEAD_STD_M * rng.normal(size=2),
        )
        across = (axes.T @ true)[:2][:, [2, 0]]
        offset = offset + across @ (np.array(std_m) * rng.normal(size=2))
        each = eyes_from_irises(offset, axes, head, iris_std_m=std_m)
        # The error of the head moves the irises by a share of what it moves the gaze.
        errors.append(each.angles_rad - [yaw, pitch])
    spread_found = np.cov(np.array(errors).T)
    ratio = np.linalg.eigvals(np.linalg.solve(spread_found, found.covariance_rad2)).real
    assert ratio.min() > 0.7
    assert ratio.max() < 1.45


@given(
    st.floats(-0.2, 0.2), st.floats(-0.1, 0.1), st.floats(0.01, 1.0), st.floats(0.01, 1.0),
    st.floats(-0.9, 0.9),
)  # fmt: skip
def test_fusion_adds_information(yaw, pitch, first, second, correlation):
    shared = correlation * first * second
    covariance = np.array([[first**2, shared], [shared, second**2]])
    fused = fuse_with_prior(EyeGaze([yaw, pitch], covariance), PRIOR)
    prior = np.diag(np.square(PRIOR))
    innovation = np.array([yaw, pitch])
    if innovation @ np.linalg.solve(prior + covariance, innovation) > 13.8:
        assert fused is None
        return
    information = np.linalg.inv(prior) + np.linalg.inv(covariance)
    assert fused.covariance_rad2 == pytest.approx(np.linalg.inv(information), rel=1e-6, abs=1e-12)
    expected = np.linalg.solve(information, np.linalg.solve(covariance, innovation))
    assert fused.angles_rad == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_eyes_that_nobody_turns_so_far_are_not_known():
    far = EyeGaze([0.7, 0.0], np.diag([0.03**2, 0.1**2]))
    assert known_eyes((None, far, EyeGaze([0.1, 0.0], np.eye(2) * 0.01)), PRIOR)[:2] == (None, None)
    head = head_at()
    axes = ray_axes_of(head)
    assert eyes_from_irises([0.02, 0.0], axes, head, iris_std_m=(5e-4, 1e-3)) is None


# --- awareness ----------------------------------------------------------------------------------


def awareness(head, eyes):
    return awareness_of(head, eye_std_rad=PRIOR, eyes=eyes)


def head_off(yaw_deg, std_rad=0.05):
    covariance = np.diag([std_rad**2] * 3 + [1e-12] * 3)
    return head_at(math.radians(yaw_deg), eyes_at=(0.0, 0.0, 1.5), covariance=covariance)


@given(st.floats(-70.0, 70.0), st.floats(-0.1, 0.1))
def test_a_measurement_that_says_nothing_never_raises_awareness(yaw_deg, eye_yaw):
    head = head_off(yaw_deg)
    vague = fuse_with_prior(EyeGaze([eye_yaw, 0.0], 1e4 * np.eye(2)), PRIOR)
    alpha, _ = awareness(head, (vague,))
    # Near the edge of the cone, uncertain eyes may look inside; not by more than the kink gives.
    inside = abs(yaw_deg) < 40.0
    assert alpha <= awareness(head, ())[0] + (1e-3 if inside else 0.05)


@pytest.mark.parametrize(
    ("head", "eyes_deg", "sign"),
    [(head_off(25.0), -16.0, 1.0), (head_at(), 15.0, -1.0)],  # turned back to the robot, and away
    ids=["on the robot", "away"],
)
def test_eyes_raise_or_lower_awareness_as_far_as_they_are_sure(head, eyes_deg, sign):
    alphas = [awareness(head, ())[0]]
    for std_deg in (8.0, 4.0, 2.0, 0.5):
        measured = EyeGaze([math.radians(eyes_deg), 0.0], np.eye(2) * math.radians(std_deg) ** 2)
        alphas.append(awareness(head, known_eyes((measured,), PRIOR))[0])
    assert (sign * np.diff(alphas) > 0.0).all()
    if sign > 0.0:
        truth = CONE.score(np.zeros(3), [0.0, 0.0, 1.0], [0.0, math.sin(0.157), math.cos(0.157)])
        assert alphas[-1] <= truth + 1e-3
