"""Copies of workers with heads of other shapes."""

from __future__ import annotations

import shutil
from importlib import resources

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests.actors.body import JOINTS, load_worker
from training.networks._head_shapes import HeadWarp, add_head_shapes

NECK = JOINTS.index("neck")


@pytest.fixture(scope="module")
def crowd(tmp_path_factory):
    folder = tmp_path_factory.mktemp("crowd")
    shipped = resources.files("sim_tests.actors.body") / "workers"
    for path in (each for each in shipped.iterdir() if each.name.startswith(("daniel", "elif"))):
        shutil.copyfile(str(path), folder / path.name)
    add_head_shapes(folder, 2, seed=3)
    return folder


def test_the_body_keeps_its_shape_and_the_head_gets_another(crowd):
    old = load_worker(str(crowd / "daniel.npz"))
    new = load_worker(str(crowd / "daniel_shape1.npz"))
    for before, after in zip(old.levels, new.levels, strict=True):
        moved = np.linalg.norm(after.vertices_m - before.vertices_m, axis=1)
        assert moved[before.weights[:, NECK] == 0.0].max() == 0.0
        head = moved[before.weights[:, NECK] == 1.0]
        assert 0.001 < np.median(head) < 0.02
        assert head.max() < 0.05
        assert np.array_equal(after.texture_rgb.shape, before.texture_rgb.shape)
    assert not np.array_equal(new.keypoints_m[:5], old.keypoints_m[:5])
    # Shoulders follow a little of the neck.
    np.testing.assert_allclose(new.keypoints_m[5:], old.keypoints_m[5:], atol=1e-3)
    assert np.array_equal(new.keypoints_m[7:], old.keypoints_m[7:])
    assert abs(new.stature_m - old.stature_m) < 0.04


@given(seed=st.integers(0, 2**32 - 1))
def test_a_warp_is_symmetric_and_its_normals_are_those_of_the_surface(seed):
    rng = np.random.default_rng(seed)
    warp = HeadWarp.random(np.array([0.02, 0.0, 1.55]), rng)
    points = np.array([0.02, 0.0, 1.65]) + rng.uniform(-0.1, 0.1, (20, 3))
    mirror = np.array([1.0, -1.0, 1.0])
    moved = points + warp.displacement_m(points)
    np.testing.assert_allclose(
        points * mirror + warp.displacement_m(points * mirror), moved * mirror, atol=1e-12
    )
    normals = rng.normal(size=(20, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    warped = warp.normals(points, normals)
    # Steps along the surface stay across its normal.
    aside = np.cross(normals, rng.normal(size=(20, 3)))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    there = points + 1e-5 * aside
    step = there + warp.displacement_m(there) - moved
    across = np.sum(step * warped, axis=1) / np.linalg.norm(step, axis=1)
    assert np.abs(across).max() < 1e-2
    assert (np.sum(warped * normals, axis=1) > 0.5).all()
