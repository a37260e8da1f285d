"""The shipped workers: shape, joints, weights and keypoints of the files."""

from __future__ import annotations

from importlib import resources

import numpy as np
import pytest
from worker_looks import LOOKS

from perception.anthropometry import HEAD_KEYPOINTS, HEAD_TEMPLATE_M, LIMBS, MEAN_STATURE_M
from perception.arrays import FloatArray
from sim_tests.actors.body import JOINTS, WorkerAsset, load_worker, worker_names

NAMES = worker_names()
LEGS = [JOINTS.index(f"{side}_hip") for side in ("left", "right")]


@pytest.fixture(params=LOOKS)
def worker(request: pytest.FixtureRequest) -> WorkerAsset:
    return load_worker(request.param)


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


def test_heads_match_the_template_of_perception(worker: WorkerAsset) -> None:
    """Nose, eyes and ears lie within 15 mm of the template after the best rigid alignment."""
    head = worker.keypoints_m[list(HEAD_KEYPOINTS)]
    template = HEAD_TEMPLATE_M - HEAD_TEMPLATE_M.mean(axis=0)
    centred = head - head.mean(axis=0)
    u, _, vt = np.linalg.svd(template.T @ centred)
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    assert np.linalg.norm(template @ turn - centred, axis=1).max() < 0.015


def test_limbs_match_the_lengths_of_perception(worker: WorkerAsset) -> None:
    """Within two standard deviations of perception's table, three for the spans."""
    for limb in LIMBS:
        start, end = (
            worker.keypoints_m[list(rows)].mean(axis=0) for rows in (limb.start, limb.end)
        )
        ratio = np.linalg.norm(start - end) / (limb.length_m * worker.stature_m / MEAN_STATURE_M)
        allowed = limb.relative_std * (3.0 if "span" in limb.name else 2.0)
        assert abs(ratio - 1.0) < allowed, limb.name


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
