"""Degradations follow optics and photons: means stay, variances are those of the sensor."""

from __future__ import annotations

import math
from dataclasses import fields

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_tests.world.camera import to_linear
from training.networks import (
    Degradation,
    degrade,
    motion_kernel,
    random_degradation,
)


def grey(level, size=(64, 96)):
    return np.full((*size, 3), level, np.uint8)


def smooth(seed=0, size=(96, 128)):
    noise = np.random.default_rng(seed).integers(0, 256, (*size, 3), np.uint8)
    return cv2.GaussianBlur(noise, (0, 0), 2.0)


def test_the_default_leaves_the_picture_as_it_is_and_draws_nothing():
    rng = np.random.default_rng(1)
    image = smooth()
    before = rng.bit_generator.state
    assert np.array_equal(degrade(image, Degradation(), rng), image)
    assert rng.bit_generator.state == before


@given(st.floats(0.0, 17.0), st.floats(0.0, math.pi))
@settings(max_examples=60, deadline=None)
def test_a_motion_kernel_has_the_length_and_direction_of_the_motion(length, direction):
    kernel = motion_kernel(length, direction).astype(float)
    assert kernel.sum() == pytest.approx(1.0, abs=1e-5)
    np.testing.assert_allclose(kernel, kernel[::-1, ::-1], atol=1e-7)
    reach = len(kernel) // 2
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    assert abs((kernel * x).sum()) < 1e-4
    assert abs((kernel * y).sum()) < 1e-4
    along = x * math.cos(direction) + y * math.sin(direction)
    across = y * math.cos(direction) - x * math.sin(direction)
    # A uniform distribution over the motion has the variance L² / 12; bilinear weights add 1/4 at
    # most, along and across.
    assert length**2 / 12 - 0.05 <= (kernel * along**2).sum() <= length**2 / 12 + 0.30
    assert (kernel * across**2).sum() <= 0.30


def test_motion_blur_keeps_the_place_of_a_spot_and_its_light():
    image = grey(0, (61, 61))
    image[30, 30] = 255
    for angle in np.linspace(0.0, math.pi, 7):
        blurred = degrade(
            image, Degradation(motion_px=17.0, motion_rad=float(angle)), np.random.default_rng(0)
        )
        light = np.asarray(to_linear(blurred))[..., 0]
        v, u = np.mgrid[0:61, 0:61]
        assert light.sum() == pytest.approx(1.0, rel=0.05)
        assert (light * u).sum() / light.sum() == pytest.approx(30.0, abs=0.1)
        assert (light * v).sum() / light.sum() == pytest.approx(30.0, abs=0.1)


@pytest.mark.parametrize("light", [1.0, 0.3, 0.1])
def test_noise_has_the_variance_of_photons_and_read_noise(light):
    electrons, read = 4000.0, 12.0
    level = 190
    effects = Degradation(light=light, gain=1.0 / light, white_e=electrons, read_noise_e=read)
    image = grey(level, (256, 256))
    out = np.asarray(to_linear(degrade(image, effects, np.random.default_rng(5))))
    true = float(np.asarray(to_linear(image)).mean())
    assert out.mean() == pytest.approx(true, rel=0.01)
    photons = true * light * electrons
    wanted = math.sqrt(photons + read**2) / photons
    assert out.std() / out.mean() == pytest.approx(wanted, rel=0.05)


def test_noise_of_a_picture_made_smaller_is_that_of_the_mean_of_its_pixels():
    effects = Degradation(white_e=500.0, read_noise_e=8.0)
    full = degrade(grey(128, (256, 256)), effects, np.random.default_rng(0))
    halved = cv2.resize(full.astype(np.float64), (128, 128), interpolation=cv2.INTER_AREA)
    direct = degrade(grey(128, (128, 128)), effects, np.random.default_rng(1), 0.5)
    assert direct.astype(float).std() == pytest.approx(halved.std(), rel=0.06)


def test_overexposure_clips_and_white_balance_keeps_green():
    image = smooth()
    bright = degrade(image, Degradation(exposure_ev=2.0), np.random.default_rng(0))
    light = np.asarray(to_linear(image))
    assert (bright[light > 0.26] == 255).all()
    np.testing.assert_array_less(image.astype(int) - 1, bright.astype(int) + 1)
    warm = degrade(image, Degradation(white_balance=(1.3, 1.0, 0.7)), np.random.default_rng(0))
    assert np.abs(warm[..., 1].astype(int) - image[..., 1].astype(int)).max() <= 1
    assert warm[..., 0].mean() > image[..., 0].mean()
    assert warm[..., 2].mean() < image[..., 2].mean()


def test_light_comes_before_clipping_and_jpeg():
    """A picture that is dark and then overexposed is not clipped: the order is the camera's."""
    image = smooth()
    both = degrade(image, Degradation(light=0.25, exposure_ev=2.0), np.random.default_rng(0))
    assert np.abs(both.astype(int) - image.astype(int)).max() <= 1


def test_random_degradations_reach_what_was_asked_and_leave_some_pictures_alone():
    rng = np.random.default_rng(0)
    drawn = [random_degradation(rng) for _ in range(4000)]
    assert 0.2 < np.mean([each == Degradation() for each in drawn]) < 0.35
    assert 15.0 < max(each.motion_px for each in drawn) <= 17.0
    assert 0.1 <= min(each.light for each in drawn) < 0.105
    assert min(each.jpeg_quality or 100 for each in drawn) == 20
    exposures = [each.exposure_ev for each in drawn]
    assert min(exposures) < -1.5
    assert max(exposures) > 1.5
    directions = np.array([each.motion_rad for each in drawn if each.motion_px > 0.0])
    assert np.histogram(directions, 4, (0.0, math.pi))[0].min() > 0.2 * len(directions)
    for field in fields(Degradation):
        values = {getattr(each, field.name) for each in drawn}
        assert len(values) > 10, field.name


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"light": 0.0}, "light must be greater than 0, got 0.0"),
        ({"motion_px": -1.0}, "motion_px must be finite and at least 0, got -1.0"),
        ({"exposure_ev": math.nan}, "exposure_ev must be finite, got nan"),
        ({"jpeg_quality": 0}, "jpeg_quality must lie in 1 to 100, got 0"),
        ({"white_balance": (1.0, 0.0, 1.0)}, "white_balance must be three factors"),
    ],
)
def test_bad_effects_and_pictures_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        Degradation(**values)
    with pytest.raises(ValueError, match="must be uint8 of shape"):
        degrade(np.zeros((4, 4), np.uint8), Degradation(), np.random.default_rng(0))
    with pytest.raises(ValueError, match="scale must be finite and greater than 0"):
        degrade(grey(3), Degradation(), np.random.default_rng(0), 0.0)
