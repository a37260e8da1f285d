"""Effects of a real camera on a picture: blur, noise, exposure, white balance, compression.

The steps come in the order of the light's way: the light in the hall, the lens and the motion
while the shutter is open, the sensor with its photons and its read noise, its gain and white
balance with clipping, the tone curve, and JPEG. All but the last two work on linear light.

Motion blur is symmetric about the middle of the exposure and noise has a mean of zero, so the truth
stays as it is. A rolling shutter moves it: :func:`rolling_shutter` is the affine map of both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_tests.world.camera import to_linear, to_srgb

#: The longest motion blur, and the lowest quality of JPEG, that training shows.
MAX_MOTION_PX: Final = 17.0
MIN_JPEG_QUALITY: Final = 20
#: The least share of the light that training shows.
MIN_LIGHT: Final = 0.1
#: Electrons of a white pixel in full light, and of the read noise: a small industrial camera.
WHITE_E: Final = 8000.0
READ_NOISE_E: Final = 6.0

_LEAST_BLUR_PX: Final = 0.3
# A line of a kernel is drawn with this many samples per pixel.
_KERNEL_SAMPLES: Final = 8
_STRONGEST_MOTION_OF_HEAD: Final = 0.45


@dataclass(frozen=True, slots=True)
class Degradation:
    """Effects of a camera on a picture; the default leaves it as it is.

    Attributes:
        light: share of full light that falls into the lens, > 0; less light means fewer photons.
        gain: amplification after the sensor, ≥ 0. ``1 / light`` restores the brightness, not the
            photons.
        exposure_ev: brightness in stops on top of both; what exceeds white is clipped.
        white_balance: factors (3,) on red, green and blue.
        motion_px: length of the motion blur in pixels of the camera.
        motion_rad: direction of the motion, from the columns towards the rows.
        defocus_px: standard deviation of the lens's blur in pixels of the camera.
        white_e: electrons of a white pixel in full light; infinity makes no shot noise.
        read_noise_e: standard deviation of the read noise, in electrons.
        grain_px: standard deviation of the blur by which a camera's processing smears its noise.
        jpeg_quality: 1 to 100, with colour at half the resolution; None does not compress.
        shutter_shear: columns that a row moves in relation to the row above it.
    """

    light: float = 1.0
    gain: float = 1.0
    exposure_ev: float = 0.0
    white_balance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    motion_px: float = 0.0
    motion_rad: float = 0.0
    defocus_px: float = 0.0
    white_e: float = math.inf
    read_noise_e: float = 0.0
    grain_px: float = 0.0
    jpeg_quality: int | None = None
    shutter_shear: float = 0.0

    def __post_init__(self) -> None:
        positive = {"light": self.light, "white_e": self.white_e}
        not_negative = {
            name: getattr(self, name)
            for name in ("gain", "motion_px", "defocus_px", "read_noise_e", "grain_px")
        }
        for name, value in positive.items():
            if not value > 0.0:
                raise ValueError(f"{name} must be greater than 0, got {value!r}")
        for name, value in not_negative.items():
            if not (value >= 0.0 and math.isfinite(value)):
                raise ValueError(f"{name} must be finite and at least 0, got {value!r}")
        for name in ("light", "exposure_ev", "motion_rad", "shutter_shear"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} must be finite, got {getattr(self, name)!r}")
        if len(self.white_balance) != 3 or not all(
            math.isfinite(factor) and factor > 0.0 for factor in self.white_balance
        ):
            raise ValueError(
                f"white_balance must be three factors greater than 0, got {self.white_balance!r}"
            )
        quality = self.jpeg_quality
        if quality is not None and not 1 <= quality <= 100:
            raise ValueError(f"jpeg_quality must lie in 1 to 100, got {quality!r}")

    @property
    def changes_light(self) -> bool:
        """True if anything but JPEG and the rolling shutter changes the pixels."""
        return replace(self, jpeg_quality=None, shutter_shear=0.0) != Degradation()


def degrade(
    image_rgb: NDArray[np.uint8],
    degradation: Degradation,
    rng: np.random.Generator,
    scale: float = 1.0,
) -> NDArray[np.uint8]:
    """Return the picture as the camera delivers it, without the rolling shutter's shear.

    Args:
        image_rgb: (H, W, 3) uint8 sRGB.
        degradation: the effects.
        rng: draws the noise; without noise nothing is drawn.
        scale: pixels of the image per pixel of the camera, ≤ 1 for an image that was made smaller
            after the camera. Blur is shorter by it. Noise is weaker by it, as the mean of
            ``1 / scale²`` pixels is.

    Raises:
        ValueError: for an image of another type or shape, and for a scale that is not positive.
    """
    image = np.asarray(image_rgb)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
        raise ValueError(
            f"image_rgb must be uint8 of shape (H, W, 3), got {image.dtype} {image.shape}"
        )
    if not (math.isfinite(scale) and scale > 0.0):
        raise ValueError(f"scale must be finite and greater than 0, got {scale!r}")
    out = image
    if degradation.changes_light:
        light = (_light_of_codes() * np.float32(degradation.light))[image]
        light = _blurred(light, degradation, scale)
        light = _noisy(light, degradation, rng, scale)
        factors = degradation.gain * 2.0**degradation.exposure_ev
        light *= np.asarray(degradation.white_balance, np.float32) * np.float32(factors)
        out = to_srgb(light)  # clips what is below black or above white
    if degradation.jpeg_quality is not None:
        out = compressed(out, degradation.jpeg_quality)
    return np.array(out, dtype=np.uint8)


def compressed(image_rgb: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Return the picture after JPEG of this quality, with colour at half the resolution."""
    settings = [cv2.IMWRITE_JPEG_QUALITY, int(quality)]
    encoded, data = cv2.imencode(".jpg", image_rgb[..., ::-1], settings)
    if not encoded:
        raise RuntimeError("an image could not be encoded as JPEG")
    decoded = cv2.imdecode(data, cv2.IMREAD_COLOR)
    return np.ascontiguousarray(np.asarray(decoded, dtype=np.uint8)[..., ::-1])


def rolling_shutter(shear: float, middle_row: float) -> NDArray[np.float64]:
    """Return the affine map (2, 3) of pixels under a rolling shutter.

    Rows are read one after another, so a turning camera shifts each by ``shear`` columns more than
    the row above it. The middle row stays.
    """
    return np.array([[1.0, shear, -shear * middle_row], [0.0, 1.0, 0.0]])


def motion_kernel(length_px: float, direction_rad: float) -> NDArray[np.float32]:
    """Return the kernel (K, K), K odd, of a motion at constant speed; its sum is 1.

    It is symmetric about its middle, so that the picture is that of the middle of the exposure.
    """
    return _motion_kernel(round(float(length_px), 2), round(float(direction_rad), 3))


@lru_cache(maxsize=4096)
def _motion_kernel(length_px: float, direction_rad: float) -> NDArray[np.float32]:
    reach = math.ceil(0.5 * length_px) + 1
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1))
    count = max(2, math.ceil(_KERNEL_SAMPLES * length_px))
    along = ((np.arange(count) + 0.5) / count - 0.5) * length_px
    # Each sample is shared by the four pixels around it.
    x, y = reach + along * math.cos(direction_rad), reach + along * math.sin(direction_rad)
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - column, y - row
    np.add.at(kernel, (row, column), (1.0 - u) * (1.0 - v))
    np.add.at(kernel, (row, column + 1), u * (1.0 - v))
    np.add.at(kernel, (row + 1, column), (1.0 - u) * v)
    np.add.at(kernel, (row + 1, column + 1), u * v)
    kernel = (kernel + kernel[::-1, ::-1]) / (2.0 * count)
    out = kernel.astype(np.float32)
    out.setflags(write=False)
    return out


@lru_cache(maxsize=1)
def _light_of_codes() -> NDArray[np.float32]:
    """Return the linear light of every sRGB code, in single precision."""
    return np.asarray(to_linear(np.arange(256, dtype=np.uint8)), dtype=np.float32)


def _blurred(
    light: NDArray[np.float32], degradation: Degradation, scale: float
) -> NDArray[np.float32]:
    defocus, motion = degradation.defocus_px * scale, degradation.motion_px * scale
    if defocus >= _LEAST_BLUR_PX:
        light = np.asarray(
            cv2.GaussianBlur(light, (0, 0), defocus, borderType=cv2.BORDER_REPLICATE),
            dtype=np.float32,
        )
    if motion >= _LEAST_BLUR_PX:
        kernel = motion_kernel(motion, degradation.motion_rad)
        light = np.asarray(
            cv2.filter2D(light, -1, kernel, borderType=cv2.BORDER_REPLICATE), dtype=np.float32
        )
    return light


def _noisy(
    light: NDArray[np.float32], degradation: Degradation, rng: np.random.Generator, scale: float
) -> NDArray[np.float32]:
    """Return the light with shot noise (normal, of the variance of the photons) and read noise."""
    shot = math.isfinite(degradation.white_e)
    if not shot and degradation.read_noise_e == 0.0:
        return light
    white_e = degradation.white_e if shot else WHITE_E
    read = np.float32((degradation.read_noise_e / white_e) ** 2)
    if shot:
        spread = light / np.float32(white_e)
        spread += read
        np.sqrt(spread, out=spread)
    else:
        spread = np.full_like(light, np.sqrt(read))
    noise = rng.standard_normal(light.shape, dtype=np.float32)
    if degradation.grain_px >= _LEAST_BLUR_PX:
        noise = np.asarray(cv2.GaussianBlur(noise, (0, 0), degradation.grain_px), dtype=np.float32)
    noise *= spread
    noise *= np.float32(min(scale, 1.0))
    noise += light
    return noise


def random_degradation(
    rng: np.random.Generator, strength: float = 1.0, size_px: float = math.inf
) -> Degradation:
    """Return random effects, a quarter of the time none.

    Args:
        rng: random generator.
        strength: 1 for the whole range; 0.5 halves how often each effect occurs.
        size_px: size of what has to be recognised, such as a head. It is not blurred by more than
            45 % of its size: such a picture teaches nothing.
    """
    if rng.random() < 0.25:
        return Degradation()

    def occurs(share: float) -> bool:
        return bool(rng.random() < strength * share)

    values: dict[str, Any] = {}
    if occurs(0.35):
        longest = min(MAX_MOTION_PX, _STRONGEST_MOTION_OF_HEAD * size_px)
        values["motion_px"] = longest * float(rng.random()) ** 1.3
        values["motion_rad"] = float(rng.uniform(0.0, math.pi))
    if occurs(0.25):
        values["defocus_px"] = min(float(rng.uniform(0.4, 1.8)), 0.1 * size_px)
    if occurs(0.7):  # the rest is free of noise
        light = math.exp(rng.uniform(math.log(MIN_LIGHT), 0.0)) if occurs(0.5) else 1.0
        values["light"] = light
        values["gain"] = light ** -float(rng.beta(0.8, 0.8))
        values["white_e"] = math.exp(rng.uniform(math.log(1500.0), math.log(2.0 * WHITE_E)))
        values["read_noise_e"] = float(rng.uniform(1.0, 2.0 * READ_NOISE_E))
        values["grain_px"] = float(max(0.0, rng.uniform(-0.6, 0.9)))
    if occurs(0.45):
        values["exposure_ev"] = float(np.clip(rng.normal(0.1, 0.9), -2.0, 2.0))
    if occurs(0.6):
        red, blue = np.exp(rng.normal(0.0, 0.16, 2)).tolist()
        values["white_balance"] = (red, float(np.exp(rng.normal(0.0, 0.04))), blue)
    if occurs(0.5):
        values["jpeg_quality"] = int(rng.integers(MIN_JPEG_QUALITY, 96))
    if occurs(0.3):
        values["shutter_shear"] = float(np.clip(rng.normal(0.0, 0.07), -0.2, 0.2))
    return Degradation(**values)
