"""The skeleton: inverse kinematics, links and skin against SciPy, scaling, and whole skins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sim_tests import SimError
from sim_tests.actors.body import JOINTS, PARENTS, load_worker, skeleton, skin_points, worker_names
from sim_tests.actors.body._pose import BodyPose, RigidPieces, link_transforms
from sim_tests.actors.body._quaternions import axis_angle, multiply, rotate
from sim_tests.actors.body._skeleton import TwoBoneLimb
from sim_tests.actors.body._skin import PELVIS, skin_pieces

vectors = st.tuples(*[st.floats(-0.08, 0.08)] * 2, st.floats(-0.5, -0.25))


@given(
    vectors,
    vectors,
    st.floats(-1.2, 1.2),
    st.floats(-0.6, 0.6),
    st.floats(0.4, 0.99),
    # A subnormal angle would divide by zero in the assertions, not in the solution.
    st.floats(-0.7, 0.7, allow_subnormal=False),
)
@settings(max_examples=60, deadline=None)
def test_two_bone_ik_brings_the_tip_to_its_target(
    first, second, forwards_rad, outwards_rad, stretched, twist_rad
):
    """For bones off the line and targets anywhere; checked by forward kinematics."""
    bones = TwoBoneLimb(first, second, (0.0, 1.0, 0.0))
    target = np.array([math.sin(forwards_rad), math.sin(outwards_rad), -1.0])
    target *= stretched * bones.reach_m / np.linalg.norm(target)
    lateral = (-math.sin(twist_rad), math.cos(twist_rad), 0.0)
    turn, bend = bones.solve(tuple(target.tolist()), lateral)
    lower = rotate(multiply(turn, axis_angle(bones.axis, bend)), second)
    tip = np.add(rotate(turn, first), lower)
    np.testing.assert_allclose(tip, target, atol=1e-6)
    # The hinge lies in the plane of target and lateral direction, on the lateral side.
    hinge = np.array(rotate(turn, bones.axis))
    assert np.cross(hinge, target) @ lateral == pytest.approx(0.0, abs=1e-6)
    across = np.cross(target, lateral)
    assert np.cross(target, hinge) @ across > 0.0


def test_the_look_of_nearest_stature_is_chosen_and_scaled() -> None:
    for name in worker_names():
        stature = load_worker(name).stature_m
        nearest = skeleton(None, stature).asset
        assert abs(nearest.stature_m - stature) < 0.01
    bones = skeleton("amina", 1.8)
    asset = load_worker("amina")
    np.testing.assert_allclose(bones.joints_m, asset.joints_m * 1.8 / asset.stature_m)
    with pytest.raises(SimError, match="nobody"):
        skeleton("nobody", 1.7)
    for stature_m in (0.99, 2.2, math.nan):
        with pytest.raises(SimError, match="stature_m"):
            skeleton(None, stature_m)


angles = st.floats(-1.5, 1.5)
rotvecs = st.tuples(angles, angles, angles)


@given(st.lists(rotvecs, min_size=16, max_size=16), st.floats(0.8, 1.2), rotvecs)
@settings(max_examples=12, deadline=None)
def test_kinematics_against_scipy_joint_by_joint(bends, scale, turn) -> None:
    """Links, pieces and skin points against a plain product of rotations about joints."""
    asset = load_worker("giulia")
    T_odom_body = np.eye(4)
    T_odom_body[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    T_odom_body[:3, 3] = (1.0, 2.0, 0.1)
    pose = BodyPose(T_odom_body, scale, np.array(bends))

    def about_joint(joint: int, share: float) -> np.ndarray:
        step = np.eye(4)
        step[:3, :3] = Rotation.from_rotvec(share * np.array(bends[joint])).as_matrix()
        centre = asset.joints_m[joint] * scale
        step[:3, 3] = centre - step[:3, :3] @ centre
        return step

    def link(joint: int) -> np.ndarray:
        return T_odom_body if joint < 0 else link(PARENTS[joint]) @ about_joint(joint, 1.0)

    links = link_transforms(asset.joints_m, pose)
    for joint in range(-1, 16):
        np.testing.assert_allclose(links[1 + joint], link(joint), atol=1e-9)
    joints = np.repeat(np.arange(-1, 16), 3)
    shares = np.tile([0.0, 0.4, 1.0], 17)
    pieces = RigidPieces(asset.joints_m, joints, shares).odom(pose, links)
    for joint, share, piece in zip(joints.tolist(), shares.tolist(), pieces, strict=True):
        expected = T_odom_body if joint < 0 else link(PARENTS[joint]) @ about_joint(joint, share)
        np.testing.assert_allclose(piece, expected, atol=1e-9)
    # A point with weights 0 and 1 moves with its link; another one by a share of the rotation.
    weights = np.zeros((2, 16))
    elbow, shoulder = JOINTS.index("left_elbow"), JOINTS.index("left_shoulder")
    weights[:, [0, shoulder]] = 1.0
    weights[:, elbow] = [1.0, 0.3]
    points = np.array([[0.1, 0.3, 0.9], [0.0, 0.25, 1.1]])
    whole = np.column_stack([points * scale, np.ones(2)])
    moved = skin_points(asset.joints_m, pose, points, weights)
    np.testing.assert_allclose(moved[0], (link(elbow) @ whole[0])[:3], atol=1e-9)
    part = link(shoulder) @ about_joint(elbow, 0.3)
    np.testing.assert_allclose(moved[1], (part @ whole[1])[:3], atol=1e-9)


def keys(corners_uv: np.ndarray) -> list[tuple[float, ...]]:
    """Return an identifier for each triangle: its centre in the texture."""
    return [tuple(row) for row in corners_uv.mean(axis=1).round(9).tolist()]


@pytest.mark.parametrize("name", worker_names()[:4])
def test_the_pieces_of_a_worker_show_all_its_skin(name: str) -> None:
    for level, skin in enumerate(load_worker(name).levels):
        pieces = skin_pieces(skin, 2)
        shown = {
            key
            for piece in pieces
            for key in keys(np.asarray(piece.mesh.uv)[piece.mesh.indices.reshape(-1, 3)])
        }
        assert shown == set(keys(skin.uv[skin.triangles]))
        joints = {piece.joint for piece in pieces}
        assert PELVIS in joints
        assert level == 2 or joints >= {JOINTS.index("neck"), JOINTS.index("left_eye")}
