"""The image sensor: photon noise and read noise of a rendered image."""

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
    """The noise of an image sensor; the default leaves the image unchanged.

    Noise follows the photon transfer curve of EMVA 1288: a pixel with N electrons has the variance
    N + read_noise_e². The colour channels are independent; there is no colour mosaic.

    Attributes:
        shot_noise: whether photons are counted, which adds Poisson noise.
        full_well_e: electrons of a saturated pixel.
        read_noise_e: standard deviation of the read noise, in electrons.
    """

    shot_noise: bool = False
    full_well_e: float = Field(default=10_000.0, ge=10.0, le=1.0e7)
    read_noise_e: float = Field(default=0.0, ge=0.0)


def expose(rgb: Any, config: SensorConfig, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return an image (H, W, 3) uint8 sRGB as the sensor delivers it.

    Without noise it is a copy, and ``rng`` draws nothing.

    Raises:
        SimError: for an image of another shape or type.
    """
    image = np.asarray(rgb)
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        raise SimError(f"rgb must be uint8 of shape (H, W, 3), got {image.dtype} {image.shape}")
    if not (config.shot_noise or config.read_noise_e > 0.0):
        return np.array(image, dtype=np.uint8)
    return to_srgb(_electrons(to_linear(image), config, rng) / config.full_well_e)


def _electrons(light: FloatArray, config: SensorConfig, rng: np.random.Generator) -> FloatArray:
    """Return the electrons read from pixels, noise included; light of 1 is white, any shape."""
    expected = light * config.full_well_e
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
