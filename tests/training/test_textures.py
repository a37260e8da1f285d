"""Procedural backgrounds and looks are random, repeatable and varied."""

from __future__ import annotations

import numpy as np
import pytest

from sim_tests.actors.body import JOINTS, load_worker
from training.networks import random_background, random_texture
from training.networks._backgrounds import Backgrounds
from training.networks._looks import FEET, HANDS, HEAD, LOWER, UPPER, parts_of_texture


@pytest.mark.parametrize("make", [random_texture, random_background])
def test_pictures_have_the_size_asked_and_the_same_seed_gives_the_same(make):
    for size in ((48, 64), (37, 21), (5, 9)):
        first, again, other = (make(np.random.default_rng(seed), size) for seed in (1, 1, 2))
        assert first.shape == (*size, 3)
        assert first.dtype == np.uint8
        assert np.array_equal(first, again)
        assert not np.array_equal(first, other)


def test_a_store_of_backgrounds_is_repeatable_and_seeds_do_not_share_pictures():
    first, again, other = Backgrounds(3, 5), Backgrounds(3, 5), Backgrounds(3, 6)
    draws = [store.random(np.random.default_rng(0)) for store in (first, again, other)]
    assert np.array_equal(draws[0], draws[1])
    assert not np.array_equal(draws[0], draws[2])
    rng = np.random.default_rng(1)
    taken = [first.sometimes(rng, 0.3) is not None for _ in range(500)]
    assert 0.22 < np.mean(taken) < 0.38
    with pytest.raises(ValueError, match="at least 1, got 0"):
        Backgrounds(0, 1)


@pytest.mark.parametrize("level", [1, 2])
def test_parts_of_a_texture_are_those_of_the_body(level):
    parts = parts_of_texture("amina", level)
    mesh = load_worker("amina").levels[level]
    height, width = parts.shape
    uv = mesh.uv[mesh.triangles].mean(axis=1)
    rows = np.clip(((1.0 - uv[:, 1]) * height).astype(int), 0, height - 1)
    columns = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
    z = mesh.vertices_m[mesh.triangles].mean(axis=1)[:, 2]
    at = parts[rows, columns]
    top = z.max()
    assert (at[z > 0.93 * top] == HEAD).mean() > 0.95
    assert (at[z < 0.04 * top] == FEET).mean() > 0.9
    assert set(np.unique(at)) == {HEAD, HANDS, UPPER, LOWER, FEET}
    knee = load_worker("amina").joints_m[JOINTS.index("left_knee"), 2]
    assert (at[np.abs(z - knee) < 0.03] == LOWER).mean() > 0.9
