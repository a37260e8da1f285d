"""The camera beside its optics: noise of the image sensor, and timing, loss and delay of frames."""

from __future__ import annotations

import heapq
from functools import lru_cache
from typing import Any, Final, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from perception.arrays import FloatArray, finite_number

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


FrameT = TypeVar("FrameT")
# Tolerance for times that are sums of many steps.
_TOLERANCE_S: Final = 1.0e-6


class CameraTiming(SimConfig):
    """Frame rate, losses and delays of a camera; the default is a perfect camera.

    Attributes:
        rate_hz: frames per second; None is one frame per control cycle of the robot.
        drop_rate: probability that a frame is lost, independent of the others.
        latency_s: least time from a frame's capture to its delivery.
        latency_jitter_s: greatest additional delay, uniformly distributed; a frame may overtake
            another.
    """

    rate_hz: float | None = Field(default=None, gt=0.0, le=1000.0)
    drop_rate: float = Field(default=0.0, ge=0.0, le=1.0)
    latency_s: float = Field(default=0.0, ge=0.0, le=10.0)
    latency_jitter_s: float = Field(default=0.0, ge=0.0, le=10.0)

    @property
    def perfect(self) -> bool:
        """True if every frame arrives at the instant of its capture."""
        return not (self.drop_rate or self.latency_s or self.latency_jitter_s)

    def delivery_s(self, stamp_s: float, rng: np.random.Generator) -> float | None:
        """Return the arrival time of a frame taken at ``stamp_s``, or None if it is lost.

        Every frame draws two numbers, so the loss of one frame does not change the others.
        """
        loss, delay = rng.random(2).tolist()
        if loss < self.drop_rate:
            return None
        return float(stamp_s + self.latency_s + delay * self.latency_jitter_s)


class FrameClock:
    """The clock of a camera: decides at each tick of the simulation whether a frame is taken.

    A frame is taken at the first tick at or after its time.
    """

    def __init__(self, timing: CameraTiming, rng: np.random.Generator) -> None:
        self._timing = timing
        self._rng = rng
        self._start_s: float | None = None
        self._next = 0

    def tick(self, now_s: float) -> tuple[bool, float | None]:
        """Return whether a frame is taken now, and its delivery time (None: lost, or not taken)."""
        now = finite_number("now_s", now_s, SimError)
        rate_hz = self._timing.rate_hz
        if rate_hz is not None:
            if self._start_s is None:
                self._start_s = now
            due = int((now - self._start_s + _TOLERANCE_S) * rate_hz)
            if due < self._next:
                return False, None
            self._next = due + 1
        return True, self._timing.delivery_s(now, self._rng)


class FrameQueue(Generic[FrameT]):
    """A queue of frames that have been captured but not delivered; it returns each frame once."""

    def __init__(self) -> None:
        # Delivery, stamp and number, by which frames are ordered, and the frame.
        self._heap: list[tuple[float, float, int, FrameT]] = []
        self._count = 0

    def put(self, stamp_s: float, delivery_s: float | None, frame: FrameT) -> None:
        """Add a frame; a lost frame (delivery None) is dropped at once."""
        if delivery_s is None:
            return
        stamp = finite_number("stamp_s", stamp_s, SimError)
        arrival = finite_number("delivery_s", delivery_s, SimError, minimum=stamp)
        heapq.heappush(self._heap, (arrival, stamp, self._count, frame))
        self._count += 1

    def take(self, now_s: float) -> tuple[FrameT, ...]:
        """Remove and return the frames that have arrived by ``now_s``, in order of arrival."""
        arrived = []
        while self._heap and self._heap[0][0] <= now_s + _TOLERANCE_S:
            arrived.append(heapq.heappop(self._heap)[-1])
        return tuple(arrived)

    def __len__(self) -> int:
        """Return the number of frames that are still to be delivered."""
        return len(self._heap)
