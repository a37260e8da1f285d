"""Postures of the arms: a level box in the hands, a phone before the eyes, no limbs that cross."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worker_looks import LOOKS

from perception import layouts as kp
from sim_tests.actors.body import (
    ACTIVITIES,
    BOX_SIZE_M,
    JOINTS,
    PARENTS,
    PHONE_SIZE_M,
    STAYING,
    Activity,
    Worker,
    skin_points,
)

PELVIS = -1
WRISTS = [kp.LEFT_WRIST, kp.RIGHT_WRIST]
PASSING_M = 0.02


def _limb(joint: int) -> str:
    name = "trunk" if joint == PELVIS else JOINTS[joint]
    side, _, part = name.partition("_")
    if part in ("shoulder", "elbow", "wrist"):
        return f"{side} arm"
    if part in ("hip", "knee", "ankle"):
        return f"{side} leg"
    return "trunk" if name in ("trunk", "spine") else "head"


def _joined(one: int, other: int) -> bool:
    """Return whether two links belong to one limb or share a joint."""
    return (
        _limb(one) == _limb(other)
        or (one != PELVIS and PARENTS[one] == other)
        or (other != PELVIS and PARENTS[other] == one)
    )


def _capsules(worker: Worker) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends (C, 2, 3) in odom and the radii (C,) of the capsules."""
    links, scale = worker.links_odom, worker.skeleton.scale
    capsules = worker.asset.capsules
    ends = np.array([[capsule.start_m, capsule.end_m] for capsule in capsules]) * scale
    mine = links[[1 + capsule.joint for capsule in capsules]]
    placed = np.einsum("cij,cej->cei", mine[:, :3, :3], ends) + mine[:, None, :3, 3]
    return placed, np.array([capsule.radius_m for capsule in capsules]) * scale


@pytest.mark.parametrize("look", LOOKS)
def test_no_limb_passes_through_another(workers: dict[str, Worker], look: str) -> None:
    """Neither capsules of two limbs nor the skin of one and a capsule of the other overlap."""
    worker = workers[look]
    asset, skin = worker.asset, worker.asset.levels[1]
    joints = [capsule.joint for capsule in asset.capsules]
    apart = np.array([[not _joined(one, other) for other in joints] for one in joints])
    # Skin of arms and legs that follows one joint fully.
    owner = np.full(len(skin.vertices_m), PELVIS)
    for joint in range(len(JOINTS)):
        owner[skin.weights[:, joint] > 0.99] = joint
    on_limb = np.array([_limb(joint).endswith(("arm", "leg")) for joint in owner.tolist()])
    vertices, weights = skin.vertices_m[on_limb], skin.weights[on_limb]
    foreign = np.array(
        [[not _joined(one, other) for other in owner[on_limb].tolist()] for one in joints]
    )
    share = np.linspace(0.0, 1.0, 17)[:, None]
    moments = [(0.0, 0.0), *itertools.product((0.5, 1.2, 2.0), np.arange(5) / 5)]
    walking = itertools.product([name for name in ACTIVITIES if name not in STAYING], moments)
    staying = ((name, moments[0]) for name in STAYING)
    for activity, (speed_mps, part) in (*walking, *staying):
        stride = float(worker.gait.stride_m(max(speed_mps, 0.1)))
        worker.place((0.0, 0.0), 0.0, part * stride, speed_mps, activity=activity)
        ends, radii = _capsules(worker)
        along = ends[:, 1] - ends[:, 0]
        axes = ends[:, :1] + share * along[:, None]
        gaps = np.linalg.norm(axes[:, None, :, None] - axes[None, :, None], axis=-1)
        depth = radii[:, None] + radii - gaps.min(axis=(2, 3))
        assert depth[apart].max() < PASSING_M, (activity, speed_mps, part)
        points = skin_points(asset.joints_m, worker.pose, vertices, weights)
        for capsule in range(len(joints)):
            near = points[foreign[capsule]] - ends[capsule, 0]
            length = max(float(along[capsule] @ along[capsule]), 1e-12)
            place = np.clip(near @ along[capsule] / length, 0.0, 1.0)
            inside = radii[capsule] - np.linalg.norm(near - place[:, None] * along[capsule], axis=1)
            assert inside.max() < PASSING_M, (activity, speed_mps, part)


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("speed_mps", [0.0, 1.2])
def test_a_box_is_level_before_the_belly_and_between_the_hands(workers, look, speed_mps) -> None:
    worker = workers[look]
    for part in np.arange(4) / 4:
        walked = part * float(worker.gait.stride_m(max(speed_mps, 0.1)))
        worker.place((1.0, -2.0), 0.9, walked, speed_mps, activity="carry_box")
        assert worker.held == "box"
        T = worker.T_odom_held
        assert T is not None
        np.testing.assert_allclose(T[:3, 2], (0.0, 0.0, 1.0), atol=1e-9)  # level
        assert T[:3, 0] @ [math.cos(0.9), math.sin(0.9), 0.0] > 0.99
        wrists = (worker.keypoints_odom_m[WRISTS] - T[:3, 3]) @ T[:3, :3]
        # One wrist on each side, a hand's thickness off the box and behind its middle.
        for (x, y, z), sign in zip(wrists, (1.0, -1.0), strict=True):
            assert 0.0 < sign * y - 0.5 * BOX_SIZE_M[1] < 0.08
            assert -0.5 * BOX_SIZE_M[0] - 0.03 < x < 0.0
            assert abs(z) < 0.5 * BOX_SIZE_M[2]
        assert 0.45 < T[2, 3] / worker.stature_m < 0.68
        # The box does not touch belly or thighs.
        points = skin_points(
            worker.asset.joints_m,
            worker.pose,
            worker.asset.levels[2].vertices_m,
            worker.asset.levels[2].weights,
        )
        local = np.abs((points - T[:3, 3]) @ T[:3, :3])
        inside = (local < 0.5 * np.array(BOX_SIZE_M) - 0.03).all(axis=1)
        assert not inside.any()


@pytest.mark.parametrize("look", LOOKS)
def test_a_phone_is_in_the_hand_before_the_eyes(workers: dict[str, Worker], look: str) -> None:
    worker = workers[look]
    worker.place((0.0, 0.0), 0.0, head_pitch_rad=math.radians(-35.0), activity="phone")
    assert worker.held == "phone"
    T = worker.T_odom_held
    assert T is not None
    to_phone = T[:3, 3] - worker.eyes_odom_m
    assert 0.22 < np.linalg.norm(to_phone) < 0.42
    # The screen faces the eyes, and the gaze points at the phone.
    assert -T[:3, 0] @ -to_phone / np.linalg.norm(to_phone) > 0.9
    assert worker.gaze_odom @ to_phone / np.linalg.norm(to_phone) > 0.93
    wrist = worker.keypoints_odom_m[kp.RIGHT_WRIST]
    assert 0.05 < np.linalg.norm(T[:3, 3] - wrist) < 0.5 * PHONE_SIZE_M[2] + 0.08
    # The left arm hangs as it does without the phone.
    left = worker.keypoints_odom_m[kp.LEFT_WRIST].copy()
    worker.place((0.0, 0.0), 0.0, head_pitch_rad=math.radians(-35.0))
    np.testing.assert_allclose(worker.keypoints_odom_m[kp.LEFT_WRIST], left, atol=1e-9)
    assert worker.held is None
    assert worker.T_odom_held is None


@given(
    st.sampled_from(
        list(itertools.permutations([name for name in ACTIVITIES if name not in STAYING], 2))
    ),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.8),
)
@settings(max_examples=15, deadline=None)
def test_hands_change_smoothly_from_one_activity_to_the_next(workers, change, share, speed_mps):
    worker = workers["amina"]
    before, name = change

    def hands(share: float) -> np.ndarray:
        doing = Activity(name, before, min(max(share, 0.0), 1.0))
        worker.place((0.0, 0.0), 0.0, 0.3, speed_mps, activity=doing)
        return np.array(worker.keypoints_odom_m[WRISTS])

    # One per cent of the change moves a hand by at most 3 cm; the ends are the activities.
    assert np.abs(hands(share + 0.005) - hands(share - 0.005)).max() < 0.03
    for end, activity in ((0.0, before), (1.0, name)):
        blended = hands(end)
        worker.place((0.0, 0.0), 0.0, 0.3, speed_mps, activity=activity)
        np.testing.assert_allclose(blended, worker.keypoints_odom_m[WRISTS], atol=1e-9)
