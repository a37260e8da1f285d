"""The shipped workers: shape, joints, weights and keypoints of the files."""

from __future__ import annotations

from importlib import resources

import numpy as np
import pytest

from perception import layouts as kp
from perception.anthropometry import HEAD_KEYPOINTS, HEAD_TEMPLATE_M, LIMBS, MEAN_STATURE_M
from perception.arrays import FloatArray
from sim_tests import SimError
from sim_tests.actors.body import (
    DETAIL_LEVELS,
    JOINTS,
    PARENTS,
    SkinMesh,
    WorkerAsset,
    load_worker,
    worker_names,
)

NAMES = worker_names()
SPINE, NECK = JOINTS.index("spine"), JOINTS.index("neck")
ARMS = [JOINTS.index(f"{side}_shoulder") for side in ("left", "right")]
LEGS = [JOINTS.index(f"{side}_hip") for side in ("left", "right")]
#: Quantisation step of the stored weights.
STEP = 1.0 / 255.0
#: Largest number of triangles of each level of detail.
MOST_TRIANGLES = (9_500, 3_200, 1_000)


@pytest.fixture(params=NAMES)
def worker(request: pytest.FixtureRequest) -> WorkerAsset:
    return load_worker(request.param)


def triangle_corners(mesh: SkinMesh) -> FloatArray:
    """Return (T, 3, 3) corners of the triangles."""
    return mesh.vertices_m[mesh.triangles]


def winding_number(points_m: FloatArray, corners_m: FloatArray) -> FloatArray:
    """Return the winding number of a surface about points: 1 inside.

    By the solid angles of van Oosterom and Strackee 1983.
    """
    a, b, c = (corners_m[None, :, k] - points_m[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    over = np.einsum("nti,nti->nt", a, np.cross(b, c))
    under = (
        la * lb * lc
        + np.einsum("nti,nti->nt", a, b) * lc
        + np.einsum("nti,nti->nt", b, c) * la
        + np.einsum("nti,nti->nt", c, a) * lb
    )
    turns: FloatArray = 2.0 * np.arctan2(over, under).sum(axis=1) / (4.0 * np.pi)
    return turns


def distance_to_segment(points_m: FloatArray, start_m: FloatArray, end_m: FloatArray) -> FloatArray:
    along = end_m - start_m
    share = np.clip((points_m - start_m) @ along / (along @ along), 0.0, 1.0)
    distance: FloatArray = np.linalg.norm(points_m - start_m - share[:, None] * along, axis=1)
    return distance


def test_at_least_twelve_distinct_workers_ship_in_10_mb() -> None:
    folder = resources.files("sim_tests.actors.body") / "workers"
    size = sum(len(entry.read_bytes()) for entry in folder.iterdir())
    assert len(NAMES) >= 12
    assert size <= 10e6
    assert (folder / "NOTICE").read_text(encoding="utf-8").find("Apache License 2.0") > 0
    lines = [load_worker(name).description for name in NAMES]
    assert len(set(lines)) == len(lines)
    vests, women = (sum(word in line for line in lines) for word in ("vest", "woman"))
    assert 0.3 * len(lines) <= vests <= 0.7 * len(lines)
    assert 0.3 * len(lines) <= women <= 0.7 * len(lines)


def test_statures_span_adults() -> None:
    statures = sorted(load_worker(name).stature_m for name in NAMES)
    assert statures[0] <= 1.55
    assert statures[-1] >= 1.90
    assert max(np.diff(statures)) < 0.12


def test_an_unknown_worker_is_refused_with_the_known_ones() -> None:
    with pytest.raises(SimError, match=f"{NAMES[0]}.*got 'nobody'"):
        load_worker("nobody")


def test_levels_are_valid_meshes_with_decreasing_numbers_of_triangles(worker: WorkerAsset) -> None:
    assert len(worker.levels) == DETAIL_LEVELS
    for mesh, most in zip(worker.levels, MOST_TRIANGLES, strict=True):
        count = len(mesh.vertices_m)
        assert 0.5 * most < len(mesh.triangles) <= most
        assert mesh.triangles.min() >= 0
        assert mesh.triangles.max() < count
        assert len(mesh.normals) == len(mesh.uv) == len(mesh.weights) == count
        assert np.isfinite(mesh.vertices_m).all()
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
        assert mesh.uv.min() >= 0.0
        assert mesh.uv.max() <= 1.0
        assert mesh.weights.min() >= 0.0
        assert mesh.weights.max() <= 1.0


def test_textures_are_square_and_have_contrast(worker: WorkerAsset) -> None:
    sides = [mesh.texture_rgb.shape[0] for mesh in worker.levels]
    assert sides == sorted(sides, reverse=True)
    for mesh in worker.levels:
        height, width, channels = mesh.texture_rgb.shape
        assert (height, channels) == (width, 3)
        assert mesh.texture_rgb.std() > 20.0


def test_levels_have_the_same_outline(worker: WorkerAsset) -> None:
    """Bounding boxes of the levels differ by no more than is visible at their distances."""
    fine = worker.levels[0].vertices_m
    for mesh, allowed_m in zip(worker.levels[1:], (0.012, 0.030), strict=True):
        assert np.abs(mesh.vertices_m.min(axis=0) - fine.min(axis=0)).max() < allowed_m
        assert np.abs(mesh.vertices_m.max(axis=0) - fine.max(axis=0)).max() < allowed_m


def test_surface_faces_outwards(worker: WorkerAsset) -> None:
    """The signed volume is that of a person, and normals agree with the winding of triangles."""
    for mesh in worker.levels:
        corners = triangle_corners(mesh)
        area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        volume_m3 = np.einsum("ti,ti->", corners.mean(axis=1), area) / 6.0
        assert 0.04 < volume_m3 < 0.20
        agree = np.einsum("ti,tki->tk", area, mesh.normals[mesh.triangles]).mean(axis=1) > 0.0
        assert agree.mean() > 0.98


def test_worker_stands_on_the_floor_at_the_origin(worker: WorkerAsset) -> None:
    for mesh in worker.levels:
        assert abs(mesh.vertices_m[:, 2].min()) < 0.005
    hips = worker.joints_m[LEGS].mean(axis=0)
    np.testing.assert_allclose(hips[:2], 0.0, atol=1e-3)
    left, right = (
        worker.joints_m[[JOINTS.index(f"{side}_{name}") for name in ("hip", "knee", "ankle")]]
        for side in ("left", "right")
    )
    for leg in (left, right):
        np.testing.assert_allclose(leg[:, :2] - leg[0, :2], 0.0, atol=1e-3)


def test_stature_is_the_height_of_the_bare_head_in_shoes(worker: WorkerAsset) -> None:
    """Hair adds up to 3 cm, a hat or helmet up to 8 cm; eyes are at 93.5 % of stature."""
    top = worker.levels[0].vertices_m[:, 2].max()
    covered = any(word in worker.description for word in ("cap", "helmet"))
    assert -0.005 < top - worker.stature_m < (0.08 if covered else 0.03)
    eyes = worker.joints_m[2:4, 2].mean()
    assert eyes / worker.stature_m == pytest.approx(0.935, abs=0.012)


def test_joints_and_keypoints_are_symmetric(worker: WorkerAsset) -> None:
    mirror = np.array([1.0, -1.0, 1.0])
    for index, name in enumerate(JOINTS):
        other = JOINTS.index(name.replace("left", "right")) if "left" in name else index
        if "right" in name:
            continue
        at = worker.joints_m[index]
        np.testing.assert_allclose(at * mirror, worker.joints_m[other], atol=2e-3, err_msg=name)
    names = kp.COCO_NAMES + kp.FOOT_NAMES
    for index, name in enumerate(names):
        if "left" in name:
            other = names.index(name.replace("left", "right"))
            at = worker.keypoints_m[index]
            np.testing.assert_allclose(
                at * mirror, worker.keypoints_m[other], atol=4e-3, err_msg=name
            )


def test_a_joints_weights_never_exceed_its_parents(worker: WorkerAsset) -> None:
    rows = [mesh.weights for mesh in worker.levels] + [worker.keypoint_weights]
    for weights in rows:
        for joint, parent in enumerate(PARENTS):
            if parent >= 0:
                assert (weights[:, joint] <= weights[:, parent] + STEP).all(), JOINTS[joint]


@pytest.mark.parametrize("joint", ["elbow", "knee"])
def test_limbs_follow_their_joint_fully_beyond_it_and_not_before_it(
    worker: WorkerAsset, joint: str
) -> None:
    """From 12 cm on either side of the joint, and smoothly in between."""
    for side in ("left", "right"):
        at = JOINTS.index(f"{side}_{joint}")
        before, after = worker.joints_m[PARENTS[at]], worker.joints_m[at + 1]
        axis = (after - before) / np.linalg.norm(after - before)
        for mesh in worker.levels:
            limb = mesh.weights[:, PARENTS[at]] > 0.999
            beyond_m = (mesh.vertices_m - worker.joints_m[at]) @ axis
            weight = mesh.weights[:, at]
            assert (weight[limb & (beyond_m > 0.125)] == 1.0).all()
            assert (weight[limb & (beyond_m < -0.125)] == 0.0).all()
            assert (weight[mesh.weights[:, PARENTS[at]] == 0.0] == 0.0).all()


def test_head_is_rigid_and_the_trunk_does_not_turn_with_it(worker: WorkerAsset) -> None:
    eyes_z_m = worker.joints_m[2, 2]
    for mesh in worker.levels:
        z, neck = mesh.vertices_m[:, 2], mesh.weights[:, NECK]
        assert (neck[z > eyes_z_m - 0.02] == 1.0).all()
        assert (neck[z < worker.joints_m[NECK, 2] - 0.16] == 0.0).all()
        arms = mesh.weights[:, ARMS].max(axis=1) > 0.5
        spine = mesh.weights[:, SPINE]
        assert (spine[z > worker.joints_m[SPINE, 2] + 0.12] > 0.98).all()
        assert (spine[(z < worker.joints_m[SPINE, 2] - 0.12) & ~arms] < 0.05).all()


def test_skin_bends_over_several_centimetres(worker: WorkerAsset) -> None:
    """No weight jumps along an edge of the finer levels, where rigid pieces would leave gaps."""
    for mesh, step in zip(worker.levels[:2], (0.40, 0.50), strict=True):
        ends = mesh.weights[mesh.triangles]
        jumps = np.abs(ends - np.roll(ends, 1, axis=1)).max(axis=(1, 2))
        assert np.percentile(jumps, 99) <= step + 2.0 * STEP
        assert jumps.max() <= step + 0.15


def test_eyeballs_are_centred_on_their_joints(worker: WorkerAsset) -> None:
    """Eyes are whole pieces of the size of an eye around their joint, and turn alone."""
    mesh = worker.levels[0]
    for joint in (JOINTS.index("left_eye"), JOINTS.index("right_eye")):
        ball = mesh.vertices_m[mesh.weights[:, joint] == 1.0]
        away = np.linalg.norm(ball - worker.joints_m[joint], axis=1)
        assert 0.010 < away.mean() < 0.020
        assert np.ptp(away) < 0.006
        middling = (mesh.weights[:, joint] > 0.0) & (mesh.weights[:, joint] < 1.0)
        assert not middling.any()


def test_keypoints_lie_in_or_on_the_body(worker: WorkerAsset) -> None:
    corners = triangle_corners(worker.levels[0])
    inside = winding_number(worker.keypoints_m, corners) > 0.5
    nearest = np.array(
        [
            np.linalg.norm(worker.levels[0].vertices_m - point, axis=1).min()
            for point in worker.keypoints_m
        ]
    )
    assert (inside | (nearest < 0.025)).all()


def test_keypoints_follow_the_joints_that_move_them(worker: WorkerAsset) -> None:
    """Wrists turn with the elbow, heels with the knee, the face with the neck."""
    weights = worker.keypoint_weights
    assert (weights[: kp.RIGHT_EAR + 1, NECK] > 0.99).all()
    for side, wrist, heel in (("left", kp.LEFT_WRIST, 19), ("right", kp.RIGHT_WRIST, 22)):
        assert weights[wrist, JOINTS.index(f"{side}_elbow")] > 0.99
        assert weights[heel, JOINTS.index(f"{side}_knee")] > 0.99
        assert weights[wrist, JOINTS.index(f"{side}_hip")] == 0.0


def test_heads_match_the_template_of_perception(worker: WorkerAsset) -> None:
    """Nose, eyes and ears lie within 15 mm of the template after the best rigid alignment."""
    head = worker.keypoints_m[list(HEAD_KEYPOINTS)]
    template = HEAD_TEMPLATE_M - HEAD_TEMPLATE_M.mean(axis=0)
    centred = head - head.mean(axis=0)
    u, _, vt = np.linalg.svd(template.T @ centred)
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    assert np.linalg.norm(template @ turn - centred, axis=1).max() < 0.015


def test_heads_are_level(worker: WorkerAsset) -> None:
    """At rest the head points straight ahead, with the template's angle from ears to nose."""
    nose, ears = worker.keypoints_m[kp.NOSE], worker.keypoints_m[[kp.LEFT_EAR, kp.RIGHT_EAR]]
    ahead = nose - ears.mean(axis=0)
    pitch_deg = np.degrees(np.arctan2(-ahead[2], ahead[0]))
    assert pitch_deg == pytest.approx(np.degrees(np.arctan2(0.012, 0.110)), abs=8.0)
    assert abs(ahead[1]) < 2e-3


@pytest.mark.parametrize("limb", LIMBS, ids=lambda limb: limb.name)
def test_limbs_match_the_lengths_of_perception(worker: WorkerAsset, limb: object) -> None:
    """Within two standard deviations of perception's table, three for the spans."""
    assert isinstance(limb, type(LIMBS[0]))
    start, end = (worker.keypoints_m[list(rows)].mean(axis=0) for rows in (limb.start, limb.end))
    ratio = np.linalg.norm(start - end) / (limb.length_m * worker.stature_m / MEAN_STATURE_M)
    assert abs(ratio - 1.0) < limb.relative_std * (3.0 if "span" in limb.name else 2.0)


def test_capsules_hold_the_surface(worker: WorkerAsset) -> None:
    """95 % of the surface lies within 3 cm of a capsule, and no capsule is too large."""
    vertices = worker.levels[0].vertices_m
    gap = np.full(len(vertices), np.inf)
    for capsule in worker.capsules:
        start, end = np.array(capsule.start_m), np.array(capsule.end_m)
        assert 0.02 < capsule.radius_m < 0.25
        gap = np.minimum(gap, distance_to_segment(vertices, start, end) - capsule.radius_m)
    assert (gap < 0.03).mean() > 0.95
    assert [capsule.joint for capsule in worker.capsules].count(-1) == 1
    limbs = {JOINTS[capsule.joint] for capsule in worker.capsules if capsule.joint >= 0}
    assert limbs == set(JOINTS) - {"left_eye", "right_eye"}
    lowest = min(min(c.start_m[2], c.end_m[2]) - c.radius_m for c in worker.capsules)
    assert abs(lowest) < 0.01


def test_hands_hang_clear_of_the_thighs(worker: WorkerAsset) -> None:
    """At least 1 cm lies between skin that follows the wrist and skin that follows the hip."""
    mesh = worker.levels[0]
    hands = mesh.vertices_m[mesh.weights[:, [a + 2 for a in ARMS]].max(axis=1) > 0.5]
    trunk = mesh.vertices_m[mesh.weights[:, ARMS].max(axis=1) < 0.05]
    trunk = trunk[np.abs(trunk[:, 2] - hands[:, 2].mean()) < 0.2]
    gaps = np.linalg.norm(hands[:, None] - trunk[None], axis=-1)
    assert gaps.min() > 0.010
