"""Fusion of head poses: more accurate where they agree, more uncertain where they do not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic_people import FACING, Given, awareness_of

from perception import (
    FusedHeadPoseEstimator,
    HeadPose,
    PersonKeypoints,
)

POSITION = np.array([0.2, -0.3, 3.0])


def head(turn=(0.0, 0.0, 0.0), std_rad=0.1, *, shift=(0.0, 0.0, 0.0), seen=None, range_std=0.04):
    rotation = Rotation.from_rotvec(turn).as_matrix() @ FACING
    covariance = np.diag([std_rad**2] * 3 + [0.05**2] * 3)
    return HeadPose(POSITION + shift, rotation, covariance, 1.0, seen, range_std)


def fixed(*heads):
    """Return a head pose estimator that always finds the given heads."""
    return Given((), heads=heads)


PERSON = PersonKeypoints(np.zeros((17, 2)), np.zeros((17, 3)), np.zeros(17), "coco")


def fuse_heads(first, second):
    fusion = FusedHeadPoseEstimator(fixed(first), fixed(second))
    (fused,) = fusion.estimate(None, None, (PERSON,))
    return fused


def test_agreeing_poses_are_combined_in_information_form():
    first, second = head((0.0, 0.0, 0.0), 0.1), head((0.06, 0.0, 0.0), 0.2)
    fused = fuse_heads(first, second)
    turn = Rotation.from_matrix(fused.rotation_camera_head @ FACING.T).as_rotvec()
    np.testing.assert_allclose(turn, [0.06 * 0.2, 0.0, 0.0], atol=1e-9)
    information = np.linalg.inv(first.covariance) + np.linalg.inv(second.covariance)
    np.testing.assert_allclose(fused.covariance, np.linalg.inv(information), atol=1e-9)


@given(st.floats(0.0, math.pi - 0.05), st.floats(0.0, math.pi - 0.05))
def test_the_covariance_never_shrinks_with_the_difference(first_turn, second_turn):
    less, more = sorted([first_turn, second_turn])
    base = head(std_rad=0.15)
    near, far = (fuse_heads(base, head((turn, 0.0, 0.0), 0.15)) for turn in (less, more))
    assert np.trace(far.covariance[:3, :3]) >= np.trace(near.covariance[:3, :3]) - 1e-12


@given(st.floats(0.8, 3.0), st.floats(0.02, 0.2), st.floats(0.02, 0.2), st.booleans())
def test_contradicting_poses_give_no_confident_awareness(turn, one, two, swap):
    """In one pose the person looks at the robot, in the other they look away."""
    towards = head(np.zeros(3), one)
    away = head((0.0, max(turn, math.radians(65.0)), 0.0), two)
    fused = fuse_heads(away, towards) if swap else fuse_heads(towards, away)
    alpha, std = awareness_of(fused)
    assert alpha - 1.28 * std < 0.35
    angle = np.array([0.0, max(turn, math.radians(65.0)), 0.0])
    assert fused.covariance[1, 1] >= angle[1] ** 2 - 1e-9


def test_fused_poses_are_consistent_over_a_population():
    rng = np.random.default_rng(0)
    count, stds = 500, (0.08, 0.15)
    poses = [
        [head(rng.normal(0.0, std, 3), std, shift=rng.normal(0.0, 0.05, 3)) for std in stds]
        for _ in range(count)
    ]
    fusion = FusedHeadPoseEstimator(*(fixed(*each) for each in zip(*poses, strict=True)))
    fused = fusion.estimate(None, None, (PERSON,) * count)
    rotations = np.array([pose.rotation_camera_head for pose in fused])
    turns = Rotation.from_matrix(FACING @ rotations.swapaxes(1, 2)).as_rotvec()
    errors = np.hstack([turns, [POSITION - pose.position_camera_m for pose in fused]])
    covariances = np.array([pose.covariance for pose in fused])
    nees = np.einsum("ni,ni->n", errors, np.linalg.solve(covariances, errors[..., None])[..., 0])
    # The covariance grows with the difference, so it is slightly too large on average.
    assert 4.0 <= np.mean(nees) <= 6.2


def test_the_lowest_given_probability_of_a_face_counts():
    assert fuse_heads(head(seen=0.9), head(seen=0.1)).face_seen == pytest.approx(0.1)
    assert fuse_heads(head(seen=0.9), head()).face_seen == pytest.approx(0.9)
    assert fuse_heads(head(), head()).face_seen is None


def test_only_a_measured_range_counts_as_measured():
    measured, assumed = head(range_std=0.04), head(range_std=None)
    assert fuse_heads(measured, assumed).range_relative_std == pytest.approx(0.04)
    assert fuse_heads(assumed, assumed).range_relative_std is None
    # Head sizes vary by 4 %, so the assumed range has a lower weight along the ray.
    shifted = head(shift=(0.0, 0.0, 0.2), range_std=None)
    moved = fuse_heads(measured, shifted).position_camera_m[2] - POSITION[2]
    assert 0.0 < moved < 0.2 * 0.05**2 / (2 * 0.05**2 + 0.9 * 0.12**2) * 1.2


def test_a_pose_of_only_one_estimator_is_kept():
    first, second = head((0.05, 0.0, 0.0)), head((0.0, 0.05, 0.0))
    fused = FusedHeadPoseEstimator(fixed(first, None, None), fixed(None, second, None))
    assert fused.estimate(None, None, (PERSON,) * 3) == (first, second, None)
    three = FusedHeadPoseEstimator(*(fixed(first) for _ in range(3)))
    (combined,) = three.estimate(None, None, (PERSON,))
    np.testing.assert_allclose(combined.covariance, first.covariance / 3.0, rtol=1e-6)
