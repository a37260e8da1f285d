"""Training data differs from evaluation data, and its crops equal those in use."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from perception import Camera
from perception.networks.heads._crops import head_crop, looking_at
from sim_tests.dataset import RenderConfig
from sim_tests.world.hall import LAYOUTS
from training.networks import HeadSample, Recipe, cropped, similarity, warp, with_surroundings


def test_evaluation_has_its_own_halls_goods_and_colours():
    recipe = Recipe()
    held_out = recipe.held_out()
    shipped = RenderConfig()
    assert set(LAYOUTS) - set(recipe.layouts) == {"crossing", "staging_hall"}
    assert shipped.variants[1] < recipe.variants[0]
    assert recipe.variants[1] < held_out.variants[0]
    assert held_out.seed != recipe.seed


@pytest.mark.parametrize("side", [20.0, 41.3, 64.0, 97.0, 150.5])
def test_the_head_crop_in_training_equals_the_head_crop_in_use(side):
    image = np.random.default_rng(4).integers(0, 256, (240, 320, 3), np.uint8)
    centre = np.array([171.3, 118.8])
    oversampling = max(1, int(np.ceil(side / 64)))
    # Training counts from the image's corner, use from the centre of its first pixel.
    matrix = similarity(centre + 0.5, 64 / side, 0.0, (64, 64), flip=False)
    theirs = warp(image, matrix, (64, 64), oversampling)
    ours = head_crop(image, centre, side)
    # OpenCV rounds coordinates to 1/32 pixel, differently for the two crops.
    assert np.abs(theirs.astype(int) - ours.astype(int)).mean() < 3.0
    assert np.corrcoef(theirs.ravel(), ours.ravel())[0, 1] > 0.999


def test_the_crops_are_equal_off_the_axis_of_a_wide_lens_too():
    rng = np.random.default_rng(5)
    image = cv2.GaussianBlur(rng.integers(0, 256, (240, 320, 3), np.uint8), (0, 0), 1.5)
    camera = Camera.from_fov(320, 240, np.radians(110.0))
    centre = np.array([262.3, 71.8])
    head = HeadSample(
        image=image,
        centre=centre + 0.5,
        side_px=45.0,
        keypoints=np.tile(centre + 0.5, (5, 1)),
        visible=np.ones(5, bool),
        focal_px=camera.fx_px,
        principal_point=np.array([camera.cx_px, camera.cy_px]) + 0.5,
        rotation_camera_head=np.eye(3),
        seen=1.0,
    )
    sample = cropped(head, np.zeros(2), 1.0, 0.0, flip=False)
    (axes,), (stretch,) = looking_at(camera, centre[None])
    ours = head_crop(image, centre, 45.0, 64, stretch)
    assert np.abs(sample["image"].astype(int) - ours.astype(int)).mean() < 3.0
    np.testing.assert_allclose(sample["rotation"], axes.T, atol=1e-9)
    np.testing.assert_allclose(sample["keypoints"], 0.5, atol=1e-9)
    moved = cropped(head, np.array([0.1, 0.0]), 1.0, 0.0, flip=False)
    assert moved["centre"][0] == pytest.approx(0.4, abs=0.02)


def test_surroundings_are_grey_outside_the_image_and_repeated_within():
    patch = np.full((10, 12, 3), 200, np.uint8)
    larger, origin = with_surroundings(patch, (0, 20), (640, 480), 4)
    assert larger.shape == (18, 20, 3)
    assert origin == (-4, 16)
    assert (larger[4:-4, :4] == 114).all()
    assert (larger[:, 4:] == 200).all()
