"""Procedural backgrounds and looks are random, repeatable and varied."""

from __future__ import annotations

import numpy as np
import pytest

from sim_tests.actors.body import JOINTS, load_worker
from training.networks import random_background, random_texture
from training.networks._backgrounds import Backgrounds
from training.networks._looks import FEET, HANDS, HEAD, LOWER, UPPER, parts_of_texture, random_look


@pytest.mark.parametrize("make", [random_texture, random_background])
def test_pictures_have_the_size_asked_and_the_same_seed_gives_the_same(make):
    for size in ((48, 64), (37, 21), (5, 9)):
        first, again, other = (make(np.random.default_rng(seed), size) for seed in (1, 1, 2))
        assert first.shape == (*size, 3)
        assert first.dtype == np.uint8
        assert np.array_equal(first, again)
        assert not np.array_equal(first, other)


def test_backgrounds_differ_in_light_colour_and_detail():
    pictures = [random_background(np.random.default_rng(n), (60, 80)) for n in range(60)]
    means = np.array([each.mean() for each in pictures])
    assert means.std() > 30.0
    assert means.min() < 60.0
    assert means.max() > 190.0
    colour = np.array([np.ptp(each.reshape(-1, 3).mean(axis=0)) for each in pictures])
    assert colour.max() > 25.0
    assert np.median(colour) < 25.0  # most real scenery has little colour
    detail = np.array([np.abs(np.diff(each.astype(int), axis=1)).mean() for each in pictures])
    assert detail.max() > 3.0 * detail.min() > 0.0


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


def test_looks_change_clothes_and_keep_faces_in_sight():
    looks = [random_look("amina", np.random.default_rng(n)) for n in range(12)]
    parts = parts_of_texture("amina", 1)
    shipped = load_worker("amina").levels[1].texture_rgb.astype(float)
    clothes = np.array([look[1][parts == UPPER].mean(axis=0) for look in looks])
    assert clothes.std(axis=0).max() > 15.0
    for look in looks:
        assert [each.shape for each in look] == [
            level.texture_rgb.shape for level in load_worker("amina").levels
        ]
        head = look[1][parts == HEAD].astype(float)
        assert 45.0 < head.mean() < 205.0
        # Features stay: light and dark of the face go together with those of the shipped one.
        together = np.corrcoef(head.mean(axis=1), shipped[parts == HEAD].mean(axis=1))[0, 1]
        assert together > 0.85
