"""The worker: proportions, gait and truth, and that PyBullet's links are where the truth says."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from perception import layouts as kp
from perception.anthropometry import (
    HEAD_TEMPLATE_M,
    LIMBS,
    MEAN_STATURE_M,
    NECK_TO_NOSE_FORWARD_M,
    NECK_TO_NOSE_UP_M,
)
from sim_tests._bullet import pybullet
from sim_tests._errors import SimError
from sim_tests._gait import STANCE, Gait
from sim_tests._layout import WarehouseLayout
from sim_tests._skeleton import Skeleton
from sim_tests._warehouse import Warehouse
from sim_tests._worker import MAX_HEAD_PITCH_RAD, MAX_HEAD_YAW_RAD, Worker

LEFT_BIG_TOE, LEFT_SMALL_TOE, LEFT_HEEL, RIGHT_BIG_TOE, RIGHT_SMALL_TOE, RIGHT_HEEL = range(17, 23)
LINKS = {
    "left_shoulder": kp.LEFT_SHOULDER,
    "right_shoulder": kp.RIGHT_SHOULDER,
    "left_elbow": kp.LEFT_ELBOW,
    "right_elbow": kp.RIGHT_ELBOW,
    "left_hip": kp.LEFT_HIP,
    "right_hip": kp.RIGHT_HIP,
    "left_knee": kp.LEFT_KNEE,
    "right_knee": kp.RIGHT_KNEE,
    "left_ankle": kp.LEFT_ANKLE,
    "right_ankle": kp.RIGHT_ANKLE,
}

postures = st.fixed_dictionaries(
    {
        "position_odom_m": st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)),
        "heading_odom_rad": st.floats(-7.0, 7.0),
        "walked_m": st.floats(-20.0, 20.0),
        "speed_mps": st.floats(0.0, 2.0),
        "head_yaw_rad": st.floats(-MAX_HEAD_YAW_RAD, MAX_HEAD_YAW_RAD),
        "head_pitch_rad": st.floats(-MAX_HEAD_PITCH_RAD, MAX_HEAD_PITCH_RAD),
    }
)


@pytest.fixture(scope="module")
def hall() -> Iterator[Warehouse]:
    with Warehouse(WarehouseLayout.open_floor()) as warehouse:
        yield warehouse


@pytest.fixture(scope="module")
def worker(hall: Warehouse) -> Worker:
    return Worker(hall, 1.82)


def _joints(hall: Warehouse, worker: Worker) -> dict[str, int]:
    """Joint rows by the order in which the body takes its angles."""
    revolute = [
        joint
        for joint in range(pybullet.getNumJoints(worker.body, physicsClientId=hall.client))
        if pybullet.getJointInfo(worker.body, joint, physicsClientId=hall.client)[2]
        == pybullet.JOINT_REVOLUTE
    ]
    order = ["neck", "nod"]
    for side in ("left", "right"):
        order += [f"{side}_{name}" for name in ("shoulder", "elbow", "hip", "knee", "ankle")]
    return dict(zip(order, revolute, strict=True))


def _link_pose(hall: Warehouse, worker: Worker, joint: int) -> tuple[np.ndarray, np.ndarray]:
    state = pybullet.getLinkState(
        worker.body, joint, computeForwardKinematics=True, physicsClientId=hall.client
    )
    rotation = np.array(pybullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
    return rotation, np.array(state[4])


@given(postures)
@settings(max_examples=60, deadline=None)
def test_truth_is_where_pybullet_has_the_links(
    hall: Warehouse, worker: Worker, posture: dict
) -> None:
    worker.place(**posture)
    joints = _joints(hall, worker)
    for name, row in LINKS.items():
        _, position = _link_pose(hall, worker, joints[name])
        np.testing.assert_allclose(position, worker.keypoints_odom_m[row], atol=1e-5)
    rotation, _ = _link_pose(hall, worker, joints["nod"])
    head = np.column_stack([-rotation[:, 2], rotation[:, 0], -rotation[:, 1]])
    np.testing.assert_allclose(head, worker.rotation_odom_head, atol=1e-5)
    # A wrist hangs from its elbow by the forearm, toes and heel are fixed to their foot.
    rotation, position = _link_pose(hall, worker, joints["left_elbow"])
    np.testing.assert_allclose(
        position - rotation[:, 2] * worker.skeleton.forearm_m,
        worker.keypoints_odom_m[kp.LEFT_WRIST],
        atol=1e-5,
    )
    rotation, position = _link_pose(hall, worker, joints["right_ankle"])
    heel = rotation.T @ (worker.keypoints_odom_m[RIGHT_HEEL] - position)
    np.testing.assert_allclose(
        heel, (-0.030 * 1.82, 0.0, 0.018 * 1.82 - worker.skeleton.ankle_height_m), atol=1e-5
    )


@given(postures)
@settings(max_examples=60, deadline=None)
def test_limbs_keep_their_lengths_and_the_head_its_template(worker: Worker, posture: dict) -> None:
    worker.place(**posture)
    points = worker.keypoints_odom_m
    for limb in LIMBS:
        length = np.linalg.norm(
            points[list(limb.start)].mean(axis=0) - points[list(limb.end)].mean(axis=0)
        )
        assert length == pytest.approx(limb.length_m * 1.82 / MEAN_STATURE_M, rel=1e-9), limb.name
    template = (points[:5] - worker.position_nose_odom_m) @ worker.rotation_odom_head
    np.testing.assert_allclose(template, HEAD_TEMPLATE_M, atol=1e-12)
    np.testing.assert_allclose(worker.eyes_odom_m, points[1:3].mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(
        worker.chest_odom_m,
        0.7 * points[5:7].mean(axis=0) + 0.3 * points[11:13].mean(axis=0),
        atol=1e-12,
    )
    np.testing.assert_array_equal(worker.position_odom_m, posture["position_odom_m"])


@given(postures, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
@settings(max_examples=40, deadline=None)
def test_a_body_looks_the_same_anywhere(
    worker: Worker, posture: dict, turn_rad: float, x_m: float, y_m: float
) -> None:
    worker.place(**posture)
    points = np.array(worker.keypoints_odom_m)
    turn = np.eye(3)
    turn[:2, :2] = [
        [math.cos(turn_rad), -math.sin(turn_rad)],
        [math.sin(turn_rad), math.cos(turn_rad)],
    ]
    moved = points @ turn.T + (x_m, y_m, 0.0)
    position = turn[:2, :2] @ posture["position_odom_m"] + (x_m, y_m)
    worker.place(
        **{
            **posture,
            "position_odom_m": position,
            "heading_odom_rad": posture["heading_odom_rad"] + turn_rad,
        }
    )
    np.testing.assert_allclose(worker.keypoints_odom_m, moved, atol=1e-9)


@pytest.mark.parametrize("stature_m", [1.5, 1.74, 1.95])
def test_stands_as_tall_as_a_person_of_that_stature(hall: Warehouse, stature_m: float) -> None:
    worker = Worker(hall, stature_m, position_odom_m=(2.0, 1.0))
    points = worker.keypoints_odom_m
    scale = stature_m / MEAN_STATURE_M
    neck = points[5:7].mean(axis=0)
    np.testing.assert_allclose(
        points[0] - neck, (NECK_TO_NOSE_FORWARD_M * scale, 0.0, NECK_TO_NOSE_UP_M * scale)
    )
    # Acromion at 0.82 and eyes at 0.94 of stature (Drillis and Contini 1966).
    assert neck[2] / stature_m == pytest.approx(0.818, abs=0.02)
    assert worker.eyes_odom_m[2] / stature_m == pytest.approx(0.936, abs=0.015)
    assert points[[LEFT_HEEL, LEFT_BIG_TOE], 2].min() > 0.0
    # What a ray from above meets first is the head; the camera's view of it is tested elsewhere.
    hit = pybullet.rayTest((2.0, 1.0, 3.0), (2.0, 1.0, 0.0), physicsClientId=hall.client)[0]
    assert hit[0] == worker.body
    assert hit[3][2] == pytest.approx(stature_m, abs=0.06)


@given(
    st.floats(-3.0, 3.0),
    st.floats(-MAX_HEAD_YAW_RAD, MAX_HEAD_YAW_RAD),
    st.floats(-MAX_HEAD_PITCH_RAD, MAX_HEAD_PITCH_RAD),
)
@settings(max_examples=60, deadline=None)
def test_head_turns_and_nods_by_the_angles_given(
    worker: Worker, heading_rad: float, yaw_rad: float, pitch_rad: float
) -> None:
    worker.place((1.0, -1.0), heading_rad, 0.3, 1.0)
    body = np.array(worker.keypoints_odom_m[5:])
    worker.place((1.0, -1.0), heading_rad, 0.3, 1.0, yaw_rad, pitch_rad)
    np.testing.assert_array_equal(worker.keypoints_odom_m[5:], body)  # the rest stays
    down, gaze, right = worker.rotation_odom_head.T
    azimuth = heading_rad + yaw_rad
    np.testing.assert_allclose(
        gaze,
        (
            math.cos(pitch_rad) * math.cos(azimuth),
            math.cos(pitch_rad) * math.sin(azimuth),
            math.sin(pitch_rad),
        ),
        atol=1e-12,
    )
    np.testing.assert_allclose(np.cross(down, gaze), right, atol=1e-12)
    ears = worker.keypoints_odom_m[kp.RIGHT_EAR] - worker.keypoints_odom_m[kp.LEFT_EAR]
    np.testing.assert_allclose(ears / np.linalg.norm(ears), right, atol=1e-12)
    eyes = worker.T_odom_eyes
    np.testing.assert_allclose(eyes[:3, 2], gaze, atol=1e-12)
    np.testing.assert_allclose(eyes[:3, 1], down, atol=1e-12)


def _walk(worker: Worker, speed_mps: float, stride_m: float, samples: int) -> np.ndarray:
    """Keypoints (samples, 23, 3) over one gait cycle of a walk along odom x."""
    frames = []
    for k in range(samples):
        walked = stride_m * k / samples
        worker.place((walked, 0.0), 0.0, walked, speed_mps)
        frames.append(worker.keypoints_odom_m)
    return np.array(frames)


@pytest.mark.parametrize(("stature_m", "stride_part"), [(1.5, 0.5), (1.75, 0.75), (1.95, 0.85)])
def test_a_foot_on_the_floor_stays_where_it_is(
    hall: Warehouse, stature_m: float, stride_part: float
) -> None:
    stride = stride_part * stature_m
    worker = Worker(hall, stature_m, stride_m=stride)
    samples = 200
    walk = _walk(worker, 1.2, stride, samples)
    flat = slice(math.ceil(0.09 * samples), math.floor(0.34 * samples))
    stance = slice(0, math.floor(STANCE * samples))
    for toe, heel, shift in (
        (LEFT_BIG_TOE, LEFT_HEEL, 0),
        (RIGHT_BIG_TOE, RIGHT_HEEL, samples // 2),
    ):
        # The right foot does half a cycle later what the left foot does now.
        cycle = np.concatenate([walk[shift:], walk[:shift] + np.array([stride, 0.0, 0.0])])
        for point in (toe, heel):
            np.testing.assert_allclose(np.ptp(cycle[flat, point], axis=0), 0.0, atol=1e-6)
        # Rolling, the sole's ends turn about the point that rests: they lift, they do not slide.
        toes = cycle[stance, toe][math.ceil(0.09 * samples) :]
        assert np.ptp(toes[:, 0]) < 0.03
        assert np.ptp(cycle[: flat.stop, heel, 0]) < 0.03
    feet = walk[:, [LEFT_BIG_TOE, LEFT_HEEL, RIGHT_BIG_TOE, RIGHT_HEEL], 2]
    lowest = feet.min(axis=1)
    assert lowest.min() > 0.0  # no foot below the floor, and always one on it
    assert lowest.max() < 0.02 * stature_m


def test_steps_keep_up_with_the_body(hall: Warehouse) -> None:
    worker = Worker(hall, 1.75)
    stride = worker.gait.stride_m
    walk = _walk(worker, 1.2, stride, 240)
    body = walk[:, 11:13].mean(axis=1)
    ankles = walk[:, [kp.LEFT_ANKLE, kp.RIGHT_ANKLE], 0] - body[:, :1]
    # The other foot does the same half a cycle later, each comes ahead of the body and falls
    # behind it by about a step, and nothing jumps: no point is faster than four times the body.
    np.testing.assert_allclose(np.roll(ankles[:, 0], 120), ankles[:, 1], atol=1e-9)
    assert ankles.max() > 0.2 * stride
    assert ankles.min() < -0.25 * stride
    steps = np.linalg.norm(np.diff(walk, axis=0), axis=2)
    assert steps.max() < 4.0 * stride / 240
    # Arms swing against the legs of their side.
    wrists = walk[:, [kp.LEFT_WRIST, kp.RIGHT_WRIST], 0] - body[:, :1]
    for side in (0, 1):
        assert np.corrcoef(ankles[:, side], wrists[:, side])[0, 1] < -0.8
    # The hips rise and fall twice a cycle by a few centimetres.
    assert 0.01 < np.ptp(body[:, 2]) < 0.06


@given(st.floats(1.4, 2.1), st.floats(0.4, 0.85), st.floats(0.0, 1.0), st.floats(0.0, 2.0))
def test_legs_are_never_overstretched(
    stature_m: float, stride_part: float, phase: float, speed_mps: float
) -> None:
    gait = Gait(Skeleton.from_stature(stature_m), stride_part * stature_m)
    posture = gait.posture(phase * gait.stride_m, speed_mps)
    assert all(math.radians(6.0) < knee < math.radians(80.0) for knee in posture.knee_rad)
    assert all(abs(hip) < math.radians(45.0) for hip in posture.hip_rad)


def test_standing_still_is_standing_upright(worker: Worker) -> None:
    worker.place((0.0, 0.0), 0.0, 0.4, 0.0)
    still = np.array(worker.keypoints_odom_m)
    worker.place((0.0, 0.0), 0.0, 1.1, 0.0)
    np.testing.assert_array_equal(worker.keypoints_odom_m, still)
    np.testing.assert_allclose(still[[kp.LEFT_ANKLE, kp.RIGHT_ANKLE], 0], 0.0, atol=1e-9)
    worker.place((0.0, 0.0), 0.0, 0.4, 0.01)  # and starting to walk is no jump
    assert np.abs(worker.keypoints_odom_m - still).max() < 0.005


def test_posture_depends_on_the_arguments_alone(worker: Worker) -> None:
    arguments = ((0.7, 0.2), 1.0, 3.3, 1.1, 0.4, -0.2)
    worker.place(*arguments)
    first = worker.keypoints_odom_m.tobytes()
    worker.place((-3.0, 1.0), -2.0, 17.0, 0.4)
    worker.place(*arguments)
    assert worker.keypoints_odom_m.tobytes() == first


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("position_odom_m", (0.0, float("nan"))),
        ("position_odom_m", (0.0, 1.0, 2.0)),
        ("heading_odom_rad", float("inf")),
        ("walked_m", "far"),
        ("speed_mps", -0.1),
        ("head_yaw_rad", 1.5),
        ("head_pitch_rad", -0.8),
    ],
)
def test_unusable_placements_are_refused_and_move_nothing(
    hall: Warehouse, worker: Worker, name: str, value: object
) -> None:
    worker.place((0.5, 0.5), 0.5, 0.5, 0.5, 0.5, 0.5)
    before = worker.keypoints_odom_m.tobytes()
    base = pybullet.getBasePositionAndOrientation(worker.body, physicsClientId=hall.client)
    good = {"position_odom_m": (1.0, 1.0), "heading_odom_rad": 0.0}
    with pytest.raises(SimError, match=name):
        worker.place(**{**good, name: value})
    assert worker.keypoints_odom_m.tobytes() == before
    assert base == pybullet.getBasePositionAndOrientation(worker.body, physicsClientId=hall.client)


def test_unusable_bodies_are_refused(hall: Warehouse) -> None:
    bodies = pybullet.getNumBodies(physicsClientId=hall.client)
    with pytest.raises(SimError, match="stature_m"):
        Worker(hall, 0.9)
    with pytest.raises(SimError, match="stride_m"):
        Worker(hall, 1.7, stride_m=3.0)
    assert pybullet.getNumBodies(physicsClientId=hall.client) == bodies


def test_physics_leaves_a_worker_where_it_was_put(hall: Warehouse, worker: Worker) -> None:
    worker.place((2.0, 2.0), 0.5, 0.3, 1.0)
    joints = _joints(hall, worker)
    before = [_link_pose(hall, worker, joint)[1] for joint in joints.values()]
    for _ in range(240):
        hall.step()
    after = [_link_pose(hall, worker, joint)[1] for joint in joints.values()]
    np.testing.assert_array_equal(after, before)
