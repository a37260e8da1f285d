"""Blur of head crops: its length grows with motion blur, and light does not change it."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception.networks.heads._crops import blur_lengths, uncertainty_factors
from training.networks import Degradation, degrade

SHARP = 0.05


def texture(seed=0, size=64):
    """Return a crop with shapes of all sizes, about as sharp as a camera draws them."""
    rng = np.random.default_rng(seed)
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


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 45.0, 90.0, 137.0])
@pytest.mark.parametrize("seed", range(3))
def test_longer_blur_in_any_direction_gives_longer_lengths(seed, angle_deg):
    crop = texture(seed)
    lengths = [length(moved(crop, px, math.radians(angle_deg))) for px in (0.0, 5.0, 10.0, 20.0)]
    assert lengths == sorted(lengths)
    assert lengths[0] < SHARP < lengths[-1]
    assert lengths[-1] > 1.2 * lengths[0]


@given(
    seed=st.integers(0, 50),
    gain=st.floats(0.7, 1.3),
    offset=st.floats(-20.0, 20.0),
    blur_px=st.sampled_from([0.0, 8.0]),
)
def test_neither_light_nor_mirrors_change_the_length(seed, gain, offset, blur_px):
    crop = moved(texture(seed), blur_px, 0.6) // 2 + 60
    brighter = np.clip(gain * (crop - 128.0) + 128.0 + offset, 0, 255).round().astype(np.uint8)
    assert length(brighter) == pytest.approx(length(crop), rel=0.08)
    for same in (crop[:, ::-1], crop[::-1], crop.transpose(1, 0, 2)):
        assert length(np.ascontiguousarray(same)) == pytest.approx(length(crop), rel=1e-4)


def test_a_crop_without_detail_has_the_longest_length():
    flat = np.full((64, 64, 3), 90, np.uint8)
    assert blur_lengths([flat, texture()])[0] == 0.25
    assert blur_lengths([]).shape == (0,)


def test_the_size_of_the_crop_hardly_matters():
    crop = moved(texture(4, 128), 12.0, 1.0)
    small = cv2.resize(crop, (64, 64), interpolation=cv2.INTER_AREA)
    assert length(small) == pytest.approx(length(crop), rel=0.02)


def test_the_factor_is_one_for_sharp_crops_and_grows_in_proportion_beyond():
    crops = [texture(), moved(texture(), 14.0, 0.3), np.zeros((64, 64, 3), np.uint8)]
    sharp, blurred, black = uncertainty_factors(crops)
    assert sharp == 1.0
    assert blurred == pytest.approx(blur_lengths(crops)[1] / SHARP)
    assert black == pytest.approx(5.0)
