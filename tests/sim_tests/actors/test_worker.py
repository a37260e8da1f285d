"""The worker: posture, head and gaze, and the links of its body in PyBullet."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worker_looks import LOOKS

from perception.anthropometry import HEAD_TEMPLATE_M
from sim_tests import SimError
from sim_tests.actors.body import (
    JOINTS,
    MAX_EYE_PITCH_RAD,
    MAX_EYE_YAW_RAD,
    MAX_HEAD_PITCH_RAD,
    MAX_HEAD_YAW_RAD,
    Worker,
    skin_points,
)
from sim_tests.actors.robot import Amr
from sim_tests.world import Warehouse
from sim_tests.world.bullet import pybullet
from sim_tests.world.hall import WarehouseLayout

# PyBullet's order of links, depth first: no eyes, and the prismatic joint of the carried box.
LINKS = [
    *(name for name in JOINTS[: JOINTS.index("left_hip")] if not name.endswith("_eye")),
    "box",
    *JOINTS[JOINTS.index("left_hip") :],
]

heads = {
    "head_yaw_rad": st.floats(-MAX_HEAD_YAW_RAD, MAX_HEAD_YAW_RAD),
    "head_pitch_rad": st.floats(-MAX_HEAD_PITCH_RAD, MAX_HEAD_PITCH_RAD),
    "eye_yaw_rad": st.floats(-MAX_EYE_YAW_RAD, MAX_EYE_YAW_RAD),
    "eye_pitch_rad": st.floats(-MAX_EYE_PITCH_RAD, MAX_EYE_PITCH_RAD),
}
postures = st.fixed_dictionaries(
    {
        "position_odom_m": st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)),
        "heading_odom_rad": st.floats(-7.0, 7.0),
        "walked_m": st.floats(-20.0, 20.0),
        "speed_mps": st.floats(0.0, 2.0),
        "activity": st.sampled_from(["none", "carry_box", "phone"]),
        **heads,
    }
)


@pytest.fixture(scope="module")
def worker(hall: Warehouse) -> Worker:
    return Worker(hall, 1.82)


def _links(hall: Warehouse, worker: Worker) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return rotation and origin of every link in PyBullet."""
    out = {}
    for row, name in enumerate(LINKS):
        state = pybullet.getLinkState(
            worker.body, row, computeForwardKinematics=True, physicsClientId=hall.client
        )
        rotation = np.array(pybullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
        out[name] = rotation, np.array(state[4])
    return out


@given(postures)
@settings(max_examples=25, deadline=None)
def test_links_agree_with_pybullets(hall: Warehouse, worker: Worker, posture: dict) -> None:
    worker.place(**posture)
    transforms = worker.links_odom
    links = _links(hall, worker)
    for row, name in enumerate(JOINTS):
        if name.endswith("_eye"):
            continue
        rotation, origin = links[name]
        joint = transforms[1 + row] @ [*worker.skeleton.joints_m[row], 1.0]
        np.testing.assert_allclose(origin, joint[:3], atol=1e-5)
        np.testing.assert_allclose(rotation, transforms[1 + row, :3, :3], atol=1e-5)
    head, _ = links["neck"]
    np.testing.assert_allclose(
        np.column_stack([-head[:, 2], head[:, 0], -head[:, 1]]),
        worker.rotation_odom_head,
        atol=1e-5,
    )
    if worker.held == "box":
        T = worker.T_odom_held
        assert T is not None
        np.testing.assert_allclose(links["box"][1], T[:3, 3], atol=1e-5)
    else:
        assert links["box"][1][2] < -50.0


@given(postures)
@settings(max_examples=25, deadline=None)
def test_head_eyes_and_chest_agree_with_the_whole_body(worker: Worker, posture: dict) -> None:
    """They are computed directly; the keypoints come from the whole pose."""
    worker.place(**posture)
    points = worker.keypoints_odom_m
    assert points.shape == (23, 3)
    # The shoulder keypoints move a little with the arms, the hip keypoints with the legs.
    np.testing.assert_allclose(
        worker.chest_odom_m,
        0.7 * points[5:7].mean(axis=0) + 0.3 * points[11:13].mean(axis=0),
        atol=0.025,
    )
    np.testing.assert_array_equal(worker.position_odom_m, posture["position_odom_m"])
    # The chest is over the body's centre line except for the sway and lean of a walk.
    assert np.linalg.norm(worker.chest_odom_m[:2] - posture["position_odom_m"]) < 0.09
    # The face is rigid, and near perception's head template.
    face = (points[[0, 3, 4]] - points[0]) @ worker.rotation_odom_head
    rest = worker.asset.keypoints_m[[0, 3, 4]] * worker.skeleton.scale
    expected = (rest - rest[0]) @ np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    np.testing.assert_allclose(face, expected, atol=1e-9)
    np.testing.assert_allclose(face, HEAD_TEMPLATE_M[[0, 3, 4]], atol=0.025)


@pytest.mark.parametrize("look", LOOKS)
def test_stands_upright_on_the_floor_as_tall_as_asked(hall: Warehouse, look: str) -> None:
    for stature_m in (1.52, 1.93):
        worker = Worker(hall, stature_m, look=look, position_odom_m=(2.0, 1.0))
        asset = worker.asset
        assert worker.pose.scale == pytest.approx(stature_m / asset.stature_m)
        skin = asset.levels[1]
        points = skin_points(asset.joints_m, worker.pose, skin.vertices_m, skin.weights)
        assert points[:, 2].min() == pytest.approx(0.0, abs=0.005)
        # Nearly its pose at rest: unlocked knees lower it by millimetres, feet point out a little.
        rest = asset.keypoints_m * worker.pose.scale + [2.0, 1.0, 0.0]
        np.testing.assert_allclose(worker.keypoints_odom_m, rest, atol=0.04)
        assert worker.eyes_odom_m[2] / stature_m == pytest.approx(0.935, abs=0.02)
        # A ray from above hits the head first.
        x, y, _ = worker.eyes_odom_m - 0.06 * worker.gaze_odom
        hit = pybullet.rayTest((x, y, 3.0), (x, y, 0.0), physicsClientId=hall.client)[0]
        assert hit[0] == worker.body
        assert hit[3][2] == pytest.approx(stature_m, abs=0.07)
        pybullet.removeBody(worker.body, physicsClientId=hall.client)


@given(st.floats(-3.0, 3.0), st.fixed_dictionaries(heads), st.floats(0.0, 2.0))
@settings(max_examples=25, deadline=None)
def test_head_and_eyes_turn_by_the_given_angles_and_nothing_else_moves(
    worker, heading_rad, head, speed_mps
):
    worker.place((1.0, -1.0), heading_rad, 0.3, speed_mps)
    body = np.array(worker.keypoints_odom_m[7:])
    worker.place((1.0, -1.0), heading_rad, 0.3, speed_mps, **head)
    np.testing.assert_allclose(worker.keypoints_odom_m[7:], body, atol=1e-12)  # the rest stays
    azimuth, pitch = heading_rad + head["head_yaw_rad"], head["head_pitch_rad"]
    down, forward, right = worker.rotation_odom_head.T
    ahead = (
        math.cos(pitch) * math.cos(azimuth),
        math.cos(pitch) * math.sin(azimuth),
        math.sin(pitch),
    )
    np.testing.assert_allclose(forward, ahead, atol=1e-9)
    np.testing.assert_allclose(right[2], 0.0, atol=1e-9)  # the head is never tilted sideways
    np.testing.assert_allclose(np.cross(down, forward), right, atol=1e-9)
    eyes = worker.T_odom_eyes
    np.testing.assert_allclose(eyes[:3, 2], forward, atol=1e-12)
    np.testing.assert_allclose(eyes[:3, 1], down, atol=1e-12)
    np.testing.assert_allclose(eyes[:3, 3], worker.eyes_odom_m, atol=1e-12)
    # The gaze differs from the head's axis by the eyes' yaw and pitch.
    yaw, up = head["eye_yaw_rad"], head["eye_pitch_rad"]
    gaze = np.array([-down, forward, -right]) @ worker.gaze_odom  # up, ahead, left
    np.testing.assert_allclose(
        gaze, (math.sin(up), math.cos(up) * math.cos(yaw), math.cos(up) * math.sin(yaw)), atol=1e-9
    )
    # The eyeballs point along the gaze.
    transforms = worker.links_odom
    for eye in ("left_eye", "right_eye"):
        axis = transforms[1 + JOINTS.index(eye), :3, 0]
        np.testing.assert_allclose(axis, worker.gaze_odom, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("position_odom_m", (0.0, float("nan"))),
        ("heading_odom_rad", float("inf")),
        ("speed_mps", 9.0),
        ("head_yaw_rad", 1.5),
        ("head_pitch_rad", -0.8),
        ("eye_yaw_rad", 0.7),
        ("eye_pitch_rad", -0.5),
        ("activity", "dance"),
    ],
)
def test_invalid_placements_are_refused_and_move_nothing(hall, worker, name, value) -> None:
    worker.place((0.5, 0.5), 0.5, 0.5, 0.5, 0.5, 0.5, activity="phone")
    before = worker.keypoints_odom_m.tobytes()
    base = pybullet.getBasePositionAndOrientation(worker.body, physicsClientId=hall.client)
    good = {"position_odom_m": (1.0, 1.0), "heading_odom_rad": 0.0}
    with pytest.raises(SimError, match=name):
        worker.place(**{**good, name: value})
    assert worker.keypoints_odom_m.tobytes() == before
    assert worker.held == "phone"
    assert base == pybullet.getBasePositionAndOrientation(worker.body, physicsClientId=hall.client)


def test_a_worker_stops_a_robot_that_drives_into_it() -> None:
    """The robot touches shins and feet, is stopped, and moves no limb."""
    with Warehouse(WarehouseLayout.named("open")) as hall:
        amr = Amr(hall)
        worker = Worker(hall, 1.8, look="ivan", position_odom_m=(1.3, 0.05), heading_odom_rad=2.8)
        before = _links(hall, worker)
        touched = False
        for _ in range(700):
            amr.command(0.6, 0.0)
            amr.advance(hall.physics_dt_s)
            hall.step()
            touched |= any(
                point[8] <= 0.0
                for point in pybullet.getContactPoints(
                    amr.body, worker.body, physicsClientId=hall.client
                )
            )
        assert touched
        assert float(amr.T_odom_base[0, 3]) < 1.3 - 0.2
        after = _links(hall, worker)
        for name in LINKS:
            np.testing.assert_allclose(after[name][1], before[name][1], atol=2e-3)
