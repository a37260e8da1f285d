"""Crops of heads and views along a ray: their content, geometry and blur."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from perception import Camera
from perception.networks.heads import (
    head_crop,
    looking_at,
    ray_axes,
    ray_focal_px,
)
from perception.networks.heads._crops import blur_lengths, uncertainty_factors
from training.networks import Degradation, degrade

DISTORTED = Camera(960, 600, 340.0, 345.0, 470.0, 310.0, [-0.15, 0.02, 0.001, -0.001, 0.0])
WIDE = Camera.from_fov(960, 600, math.radians(120.0))


@given(
    u=st.floats(100.0, 540.0),
    v=st.floats(100.0, 380.0),
    side=st.floats(10.0, 180.0),
    size=st.sampled_from([32, 64, 224]),
)
@settings(max_examples=40, deadline=None)
def test_a_brightness_ramp_is_the_same_in_any_crop(u, v, side, size):
    """Bilinear sampling and area averages are both exact for a linear ramp."""
    ramp = np.zeros((480, 640, 3), np.uint8)
    ramp[..., 0] = np.round(np.arange(640) * 0.375)[None, :]
    ramp[..., 1] = np.round(np.arange(480) * 0.5)[:, None]
    crop = head_crop(ramp, (u, v), side, size).astype(float)
    steps = ((np.arange(size) + 0.5) / size - 0.5) * side
    np.testing.assert_allclose(crop[:, :, 0], np.tile((u + steps) * 0.375, (size, 1)), atol=1.3)
    np.testing.assert_allclose(crop[:, :, 1].T, np.tile((v + steps) * 0.5, (size, 1)), atol=1.3)
    assert abs(np.mean(crop[..., 0]) - 0.375 * u) < 0.35


def test_shrinking_averages_over_areas():
    """A chequerboard of single pixels becomes uniformly grey."""
    board = np.zeros((480, 640, 3), np.uint8)
    board[(np.add.outer(np.arange(480), np.arange(640)) % 2).astype(bool)] = 255
    crop = head_crop(board, (320.2, 240.4), 400.0)
    assert abs(float(crop.mean()) - 127.5) < 2.0
    assert float(crop.std()) < 12.0


@pytest.mark.parametrize("centre", [(-500.0, 100.0), (1e9, -1e9), (320.0, 900.0)])
def test_a_crop_outside_the_image_is_grey(centre):
    image = np.zeros((480, 640, 3), np.uint8)
    assert (head_crop(image, centre, 80.0) == 114).all()


def test_a_crop_across_the_border_is_grey_outside_the_image():
    image = np.full((480, 640, 3), 255, np.uint8)
    crop = head_crop(image, (-0.5, 239.5), 64.0)
    assert (crop[:, :31] == 114).all()
    assert (crop[:, 33:] == 255).all()


@pytest.mark.parametrize("camera", [WIDE, DISTORTED], ids=["pinhole", "distorted"])
@given(u=st.floats(20.0, 940.0), v=st.floats(20.0, 580.0), angle=st.floats(0.0, 6.28))
@settings(max_examples=40, deadline=None)
def test_the_stretch_is_the_derivative_of_the_projection_at_a_ray(camera, u, v, angle):
    axes, stretch = looking_at(camera, np.array([[u, v]]))
    step = 0.02 * np.array([math.cos(angle), math.sin(angle)])
    both = np.array([[*step, 1.0], [*-step, 1.0]]) @ axes[0].T
    ahead, behind = camera.project(both)
    expected = stretch[0] @ (2.0 * step) * ray_focal_px(camera)
    np.testing.assert_allclose(ahead - behind, expected, atol=0.02 * np.linalg.norm(expected))


@pytest.mark.parametrize("pixel", [(480.0, 300.0), (860.0, 180.0), (60.0, 420.0)])
def test_a_crop_looks_as_if_the_camera_had_been_turned_to_the_head(pixel):
    """A pattern of directions around a ray gives the same crop at any place of the image."""
    (axes,), (stretch,) = looking_at(WIDE, np.array([pixel]))
    v, u = np.mgrid[0:600, 0:960]
    rays = WIDE.normalise(np.stack([u.ravel(), v.ravel()], axis=1))
    turned = np.column_stack([rays, np.ones(len(rays))]) @ axes
    a, b = (turned[:, :2] / turned[:, 2:]).T * ray_focal_px(WIDE)

    def pattern(across, down):
        return 127.0 + 60.0 * np.sin(across / 7.0) + 50.0 * np.cos(down / 5.0)

    shown = np.where(turned[:, 2] > 0.0, pattern(a, b), 0.0).reshape(600, 960)
    image = np.repeat(np.clip(np.rint(shown), 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    side = 24.0
    crop = head_crop(image, pixel, side, 64, stretch)[..., 0].astype(float)
    steps = ((np.arange(64) + 0.5) / 64 - 0.5) * side
    expected = pattern(steps[None, :], steps[:, None])
    # The stretch is first order: an error of some tenths of a pixel remains at the crop's corners.
    assert np.abs(crop - expected).mean() < 4.0
    plain = head_crop(image, pixel, side, 64)[..., 0].astype(float)
    off_axis = math.hypot(pixel[0] - 480.0, pixel[1] - 300.0) > 100.0
    assert (np.abs(plain - expected).mean() > 15.0) == off_axis


@given(x=st.floats(-1.5, 1.5), y=st.floats(-1.5, 1.5))
def test_ray_axes_are_the_smallest_rotation_onto_the_ray(x, y):
    (axes,) = ray_axes(np.array([[x, y]]))
    ray = np.array([x, y, 1.0]) / math.sqrt(x * x + y * y + 1.0)
    expected, _ = Rotation.align_vectors([ray], [[0.0, 0.0, 1.0]])
    np.testing.assert_allclose(axes[:, 2], ray, atol=1e-12)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    angle = np.linalg.norm(Rotation.from_matrix(axes).as_rotvec())
    assert angle == pytest.approx(math.acos(min(ray[2], 1.0)), abs=1e-7)
    assert expected.magnitude() == pytest.approx(angle, abs=1e-6)


# --- blur -----------------------------------------------------------------------------------------


SHARP = 0.05


def texture(size=64):
    """Return a crop with shapes of all sizes, about as sharp as a camera draws them."""
    rng = np.random.default_rng(0)
    picture = np.zeros((size, size), np.float32)
    for scale in (2, 4, 8, 16):
        coarse = rng.normal(0.0, scale, (size // scale, size // scale)).astype(np.float32)
        picture += cv2.resize(coarse, (size, size), interpolation=cv2.INTER_CUBIC)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.5)
    picture = 128.0 + 40.0 * (picture - picture.mean()) / picture.std()
    return np.repeat(np.clip(picture, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def moved(crop, length_px, angle_rad):
    """Return the crop blurred by a motion."""
    motion = Degradation(motion_px=length_px, motion_rad=angle_rad)
    return degrade(crop, motion, np.random.default_rng(0))


def length(crop):
    return float(blur_lengths([crop])[0])


@pytest.mark.parametrize("angle_deg", [0.0, 45.0, 137.0])
def test_longer_blur_in_any_direction_gives_longer_lengths(angle_deg):
    crop = texture()
    lengths = [length(moved(crop, px, math.radians(angle_deg))) for px in (0.0, 5.0, 10.0, 20.0)]
    assert lengths == sorted(lengths)
    assert lengths[0] < SHARP < lengths[-1]
    assert lengths[-1] > 1.2 * lengths[0]


def test_the_factor_is_one_for_sharp_crops_and_grows_in_proportion_beyond():
    crops = [texture(), moved(texture(), 14.0, 0.3), np.zeros((64, 64, 3), np.uint8)]
    sharp, blurred, black = uncertainty_factors(crops)
    assert sharp == 1.0
    assert blurred == pytest.approx(blur_lengths(crops)[1] / SHARP)
    assert black == pytest.approx(5.0)
