"""The image sensor: exposure, vignetting, photon noise and read noise of a rendered image."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from perception.arrays import FloatArray

from ..config import SimConfig
from ..errors import SimError

# From this number of electrons on, the Poisson distribution is replaced by a normal one.
_MANY_ELECTRONS: Final = 60.0
# Steps of linear light in the table of sRGB codes.
_LIGHT_STEPS: Final = 65536


class SensorConfig(SimConfig):
    """The settings of an image sensor; the default leaves the image unchanged.

    Noise follows the photon transfer curve of EMVA 1288: a pixel with N electrons has the variance
    N + read_noise_e². The colour channels are independent; there is no colour mosaic.

    Attributes:
        exposure_s: exposure time; it sets the length of motion blur only. Brightness is set by
            :attr:`exposure_ev`.
        exposure_ev: brightness in stops; +1 is twice the light.
        shot_noise: whether photons are counted, which adds Poisson noise.
        full_well_e: electrons of a saturated pixel at 0 dB gain.
        gain_db: amplification; 6 dB needs half the light for the same image and doubles the ISO.
        read_noise_e: standard deviation of the read noise, in electrons.
        vignetting: share of the light lost in the corners; the falloff follows cos⁴.
        motion_blur: whether things that move during the exposure smear.
    """

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
        """The number of electrons of a white pixel."""
        return float(self.full_well_e * 10.0 ** (-self.gain_db / 20.0))


def expose(rgb: Any, config: SensorConfig, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return an image (H, W, 3) uint8 sRGB as the sensor delivers it.

    The generator is used for noise only: without noise, nothing is drawn from it. Motion blur is
    not included: see :func:`motion_blur`.

    Raises:
        SimError: for an image that is not uint8 of shape (H, W, 3).
    """
    image = np.asarray(rgb)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
        raise SimError(f"rgb must be uint8 of shape (H, W, 3), got {image.dtype} {image.shape}")
    noisy = config.shot_noise or config.read_noise_e > 0.0
    if not noisy and config.exposure_ev == 0.0 and config.vignetting == 0.0:
        return np.array(image, dtype=np.uint8)
    light = to_linear(image) * 2.0**config.exposure_ev
    if config.vignetting > 0.0:
        light *= _falloff(image.shape[0], image.shape[1], config.vignetting)[..., None]
    if noisy:
        light = collected_electrons(light, config, rng) / config.white_e
    return to_srgb(light)


def collected_electrons(
    light: FloatArray, config: SensorConfig, rng: np.random.Generator
) -> FloatArray:
    """Return the electrons read from pixels, noise included; light of 1 is white, any shape."""
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
    """Return linear light, 0 to 1, from sRGB codes (IEC 61966-2-1)."""
    return np.asarray(_decoding()[srgb])


def to_srgb(light: FloatArray) -> NDArray[np.uint8]:
    """Return sRGB codes from linear light; values below 0 are black, above 1 white."""
    top = _LIGHT_STEPS - 1.0
    steps = np.clip(light * top + 0.5, 0.0, top).astype(np.uint16)
    return np.asarray(_encoding()[steps])


@lru_cache(maxsize=1)
def _decoding() -> FloatArray:
    code = np.arange(256) / 255.0
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


@lru_cache(maxsize=1)
def _encoding() -> NDArray[np.uint8]:
    light = np.arange(_LIGHT_STEPS) / (_LIGHT_STEPS - 1.0)
    code = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055)
    return np.rint(255.0 * code).astype(np.uint8)


def _falloff(height: int, width: int, lost: float) -> FloatArray:
    """Return the share (H, W) of light that remains: cos⁴ = 1 / (1 + tan²)²; corner: 1 − lost."""
    x = (np.arange(width) + 0.5) / width * 2.0 - 1.0
    y = (np.arange(height) + 0.5) / height * 2.0 - 1.0
    square = x[None, :] ** 2 * width**2 + y[:, None] ** 2 * height**2
    square /= width**2 + height**2
    return np.asarray((1.0 + ((1.0 - lost) ** -0.5 - 1.0) * square) ** -2)
