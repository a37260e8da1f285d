"""The sensor: light in, electrons and bytes out, by the photon transfer curve."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from sim_tests import SimError
from sim_tests.world.camera import SensorConfig, collected_electrons, expose, to_linear, to_srgb

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


@pytest.mark.parametrize("ev", [-2.0, -1.0, 0.5])
def test_a_stop_is_a_factor_of_two(ev: float) -> None:
    image = RAMP[:, 60:150]
    out = expose(image, SensorConfig(exposure_ev=ev), np.random.default_rng(0))
    # Bytes are rounded by half a code, and light goes with about the 2.4th power of the code.
    np.testing.assert_allclose(to_linear(out), to_linear(image) * 2.0**ev, rtol=0.04)


@pytest.mark.parametrize("level", [0.0005, 0.003, 0.02, 0.1, 0.5])
@pytest.mark.parametrize(("gain_db", "read_noise_e"), [(0.0, 0.0), (0.0, 8.0), (18.0, 3.0)])
def test_noise_follows_the_photon_transfer_curve(
    level: float, gain_db: float, read_noise_e: float
) -> None:
    config = SensorConfig(
        shot_noise=True, full_well_e=9000.0, gain_db=gain_db, read_noise_e=read_noise_e
    )
    count = 200_000
    electrons = collected_electrons(np.full(count, level), config, np.random.default_rng(7))
    expected = level * 9000.0 * 10.0 ** (-gain_db / 20.0)
    variance = expected + read_noise_e**2
    assert electrons.mean() == pytest.approx(expected, abs=5.0 * math.sqrt(variance / count))
    # The variance of a variance: a Poisson variable adds 1 / N to the normal one's 2.
    spread = variance * math.sqrt((2.0 + 1.0 / max(variance, 1.0)) / count)
    assert electrons.var() == pytest.approx(variance, abs=6.0 * spread)


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


def test_gain_trades_photons_for_brightness() -> None:
    """The same image with half the light: noise rises by √2 for 6.02 dB."""
    flat = np.full((100, 100, 3), 150, np.uint8)
    spreads = [
        to_linear(
            expose(flat, SensorConfig(shot_noise=True, gain_db=gain), np.random.default_rng(1))
        ).std()
        for gain in (0.0, 20.0 * math.log10(2.0))
    ]
    assert spreads[1] / spreads[0] == pytest.approx(math.sqrt(2.0), rel=0.03)


def test_vignetting_loses_its_share_in_the_corner_and_nothing_in_the_middle() -> None:
    flat = np.full((101, 201, 3), 200, np.uint8)
    light = to_linear(expose(flat, SensorConfig(vignetting=0.4), np.random.default_rng(0)))[..., 0]
    full = float(to_linear(np.uint8([200]))[0])
    assert light[50, 100] == pytest.approx(full, rel=0.01)
    # The centre of the corner's pixel lies half a pixel inside the image.
    assert light[0, 0] == pytest.approx(0.6 * full, rel=0.02)
    assert light[0, 100] > light[50, 0] > light[0, 0]  # falls with the distance from the middle
    # cos⁴: at half the corner's distance, tan² is a quarter of the corner's.
    corner_tan2 = 0.6**-0.5 - 1.0
    assert light[25, 50] == pytest.approx(full * (1.0 + corner_tan2 / 4.0) ** -2, rel=0.02)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 30.0), st.booleans())
def test_the_same_seed_gives_the_same_image(seed: int, read_noise_e: float, shot: bool) -> None:
    config = SensorConfig(shot_noise=shot, read_noise_e=read_noise_e, exposure_ev=-0.3)
    first, second = (expose(RAMP, config, np.random.default_rng(seed)) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_unusable_images_and_settings_are_refused() -> None:
    with pytest.raises(SimError, match="uint8"):
        expose(RAMP.astype(float), SensorConfig(), np.random.default_rng(0))
    with pytest.raises(ValidationError, match="did you mean 'gain_db'"):
        SensorConfig(gain=3.0)  # type: ignore[call-arg]
    with pytest.raises(ValidationError, match="exposure_s"):
        SensorConfig(exposure_s=0.0)
