"""The sensor: light in, electrons and bytes out, by the photon transfer curve."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from sim_tests import SimError
from sim_tests.world.camera import SensorConfig, expose, to_linear, to_srgb

RAMP = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2).repeat(8, axis=0)


def test_the_default_changes_nothing_and_draws_no_random_numbers() -> None:
    rng = np.random.default_rng(0)
    out = expose(RAMP, SensorConfig(), rng)
    np.testing.assert_array_equal(out, RAMP)
    assert not np.shares_memory(out, RAMP)
    assert rng.random() == np.random.default_rng(0).random()


def test_srgb_is_undone_exactly() -> None:
    codes = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(to_srgb(to_linear(codes)), codes)
    # Two points of IEC 61966-2-1.
    assert to_linear(np.uint8([188]))[0] == pytest.approx(0.5029, abs=1e-4)
    assert to_srgb(np.array([-0.5, 0.2140, 1.7])).tolist() == [0, 127, 255]


def test_noise_keeps_the_mean_of_an_image_and_its_curve() -> None:
    """Light passes through sRGB codes and back, where no noise is clipped at white or black."""
    config = SensorConfig(shot_noise=True, full_well_e=3000.0, read_noise_e=5.0)
    rng = np.random.default_rng(3)
    for code in (90, 140, 200):
        flat = np.full((120, 120, 3), code, np.uint8)
        light = to_linear(expose(flat, config, rng))
        level = float(to_linear(np.uint8([code]))[0])
        assert light.mean() == pytest.approx(level, rel=0.004)
        variance = (level * 3000.0 + 25.0) / 3000.0**2
        step = float(np.diff(to_linear(np.uint8([code, code + 1])))[0])
        assert light.var() == pytest.approx(variance + step**2 / 12.0, rel=0.05)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 30.0), st.booleans())
def test_the_same_seed_gives_the_same_image(seed: int, read_noise_e: float, shot: bool) -> None:
    config = SensorConfig(shot_noise=shot, read_noise_e=read_noise_e)
    first, second = (expose(RAMP, config, np.random.default_rng(seed)) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_unusable_images_and_settings_are_refused() -> None:
    with pytest.raises(SimError, match="uint8"):
        expose(RAMP.astype(float), SensorConfig(), np.random.default_rng(0))
    with pytest.raises(ValidationError, match="did you mean 'shot_noise'"):
        SensorConfig(shot_nois=True)  # type: ignore[call-arg]
    with pytest.raises(ValidationError, match="full_well_e"):
        SensorConfig(full_well_e=0.0)
