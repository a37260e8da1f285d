"""Quaternions, links, rigid pieces and skin points against SciPy's rotations."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sim_tests.actors.body import JOINTS, PARENTS, load_worker, skin_points
from sim_tests.actors.body._pose import (
    BodyPose,
    link_transforms,
    piece_transforms,
    rotation_matrices,
)
from sim_tests.actors.body._quaternions import (
    axis_angle,
    from_axes,
    multiply,
    rotation_matrix,
    rotation_vector,
    slerp,
)

angles = st.floats(-1.5, 1.5)
rotvecs = st.tuples(angles, angles, angles)


@given(st.lists(rotvecs, min_size=16, max_size=16), st.floats(0.8, 1.2), rotvecs)
@settings(max_examples=12, deadline=None)
def test_kinematics_against_scipy_joint_by_joint(
    bends: list, scale: float, turn: tuple[float, float, float]
) -> None:
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
    pieces = piece_transforms(asset.joints_m, pose, joints, shares)
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


@given(rotvecs, rotvecs, st.floats(0.0, 1.0))
@settings(deadline=None)
def test_quaternions_against_scipy(first: tuple, second: tuple, share: float) -> None:
    one, other = (Rotation.from_rotvec(v) for v in (first, second))
    p, q = (tuple(r.as_quat().tolist()) for r in (one, other))
    np.testing.assert_allclose(
        rotation_matrix(multiply(p, q)), (one * other).as_matrix(), atol=1e-12
    )
    np.testing.assert_allclose(rotation_matrices(np.array([first]))[0], one.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(rotation_vector(p), one.as_rotvec(), atol=1e-9)
    columns = tuple(tuple(column) for column in one.as_matrix().T.tolist())
    np.testing.assert_allclose(rotation_matrix(from_axes(*columns)), one.as_matrix(), atol=1e-9)
    middle = one * Rotation.from_rotvec(share * (one.inv() * other).as_rotvec())
    np.testing.assert_allclose(rotation_matrix(slerp(p, q, share)), middle.as_matrix(), atol=1e-9)
    length = float(np.linalg.norm(first))
    if length > 1e-6:
        axis = tuple((np.array(first) / length).tolist())
        np.testing.assert_allclose(
            rotation_matrix(axis_angle(axis, length)), one.as_matrix(), atol=1e-9
        )
