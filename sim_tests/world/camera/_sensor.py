"""What an image sensor does to a clean picture: exposure, vignetting, photon and read noise."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from perception.arrays import FloatArray
from tracking.config import StrictConfig

from ..errors import SimError

# Above so many electrons the Poisson distribution is a normal one for every purpose here.
_MANY_ELECTRONS: Final = 60.0
_CODES: Final = 65536


class SensorConfig(StrictConfig):
    """How a camera turns light into numbers; the default adds nothing.

    Noise follows the photon transfer curve of EMVA 1288: a pixel that has collected N electrons
    has the variance N + read_noise_e². Channels are independent; there is no colour mosaic.

    Attributes:
        exposure_s: how long the shutter is open; it sets the length of motion blur only, its
            brightness is :attr:`exposure_ev`.
        exposure_ev: brightness in stops: +1 is twice the light.
        shot_noise: whether light comes in photons.
        full_well_e: electrons of a saturated pixel at no gain.
        gain_db: amplification; 6 dB is half the light for the same picture, and twice the ISO.
        read_noise_e: standard deviation of the electronics, in electrons.
        vignetting: share of the light lost in the corners, falling off as cos⁴ does.
        motion_blur: whether movement during the exposure smears.
    """

    error: ClassVar[type[ValueError]] = SimError

    exposure_s: float = Field(default=0.01, gt=0.0, le=1.0)
    exposure_ev: float = Field(default=0.0, ge=-8.0, le=8.0)
    shot_noise: bool = False
    full_well_e: float = Field(default=10_000.0, ge=10.0, le=1.0e7)
    gain_db: float = Field(default=0.0, ge=0.0, le=60.0)
    read_noise_e: float = Field(default=0.0, ge=0.0)
    vignetting: float = Field(default=0.0, ge=0.0, lt=1.0)
    motion_blur: bool = False

    @property
    def white_e(self) -> float:
        """Electrons that make a pixel white."""
        return float(self.full_well_e * 10.0 ** (-self.gain_db / 20.0))


def expose(rgb: Any, config: SensorConfig, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return the picture (H, W, 3) uint8 sRGB as the sensor gives it.

    The generator is used for noise only, so without noise nothing is drawn from it. Motion blur
    needs more than a picture: see :func:`sim_tests.world.camera._motion_blur.motion_blur`.

    Raises:
        SimError: for anything but a picture of bytes.
    """
    picture = np.asarray(rgb)
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3:
        raise SimError(f"rgb must be uint8 of shape (H, W, 3), got {picture.dtype} {picture.shape}")
    noisy = config.shot_noise or config.read_noise_e > 0.0
    if not noisy and config.exposure_ev == 0.0 and config.vignetting == 0.0:
        return np.array(picture, dtype=np.uint8)
    light = to_linear(picture) * 2.0**config.exposure_ev
    if config.vignetting > 0.0:
        light *= _falloff(picture.shape[0], picture.shape[1], config.vignetting)[..., None]
    if noisy:
        light = collected_electrons(light, config, rng) / config.white_e
    return to_srgb(light)


def collected_electrons(
    light: FloatArray, config: SensorConfig, rng: np.random.Generator
) -> FloatArray:
    """Electrons read from pixels that light of this strength falls on; 1 is white, any shape."""
    expected = light * config.white_e
    spread = np.full_like(expected, config.read_noise_e**2)
    if config.shot_noise:
        spread += expected
        few = np.flatnonzero(expected < _MANY_ELECTRONS)
        photons = rng.poisson(expected.flat[few])
        spread.flat[few] = config.read_noise_e**2
        expected.flat[few] = photons
    return np.asarray(expected + np.sqrt(spread) * rng.standard_normal(expected.shape))


def to_linear(srgb: NDArray[np.uint8]) -> FloatArray:
    """Light, 0 to 1, from sRGB bytes (IEC 61966-2-1)."""
    return np.asarray(_decoding()[srgb])


def to_srgb(light: FloatArray) -> NDArray[np.uint8]:
    """SRGB bytes from light; below 0 is black, above 1 white."""
    codes = np.clip(light * (_CODES - 1.0) + 0.5, 0.0, _CODES - 1.0).astype(np.uint16)
    return np.asarray(_encoding()[codes])


@lru_cache(maxsize=1)
def _decoding() -> FloatArray:
    code = np.arange(256) / 255.0
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


@lru_cache(maxsize=1)
def _encoding() -> NDArray[np.uint8]:
    light = np.arange(_CODES) / (_CODES - 1.0)
    code = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055)
    return np.rint(255.0 * code).astype(np.uint8)


def _falloff(height: int, width: int, lost: float) -> FloatArray:
    """(H, W) share of the light that is left: cos⁴ = 1 / (1 + tan²)², 1 − ``lost`` in a corner."""
    x = (np.arange(width) + 0.5) / width * 2.0 - 1.0
    y = (np.arange(height) + 0.5) / height * 2.0 - 1.0
    square = x[None, :] ** 2 * width**2 + y[:, None] ** 2 * height**2
    square /= width**2 + height**2
    return np.asarray((1.0 + ((1.0 - lost) ** -0.5 - 1.0) * square) ** -2)
