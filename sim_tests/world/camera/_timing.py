"""When a camera's frames are taken, lost and delivered."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Final, Generic, TypeVar

import numpy as np
from pydantic import Field

from perception.arrays import finite_number
from tracking.config import StrictConfig

from ..errors import SimError

FrameT = TypeVar("FrameT")
# Slack for times that are sums of many steps.
_EARLY_S: Final = 1.0e-6


class CameraTiming(StrictConfig):
    """Frame rate, losses and delays of a camera; the default is a perfect one.

    Attributes:
        rate_hz: frames a second; None is one whenever the robot asks, every control cycle.
        drop_rate: share of the frames that never arrive, each on its own.
        latency_s: from a frame's capture to its delivery, at least.
        latency_jitter_s: up to so much more, evenly distributed. A frame may overtake another.
    """

    error: ClassVar[type[ValueError]] = SimError

    rate_hz: float | None = Field(default=None, gt=0.0, le=1000.0)
    drop_rate: float = Field(default=0.0, ge=0.0, le=1.0)
    latency_s: float = Field(default=0.0, ge=0.0, le=10.0)
    latency_jitter_s: float = Field(default=0.0, ge=0.0, le=10.0)

    @property
    def perfect(self) -> bool:
        """Whether every frame arrives at the instant at which it is taken."""
        return not (self.drop_rate or self.latency_s or self.latency_jitter_s)

    def delivery_s(self, stamp_s: float, rng: np.random.Generator) -> float | None:
        """When a frame taken at ``stamp_s`` arrives, or None when it is lost.

        Every frame draws the same amount of chance, so one frame's fate changes no other's.
        """
        lost, late = rng.random(2).tolist()
        if lost < self.drop_rate:
            return None
        return float(stamp_s + self.latency_s + late * self.latency_jitter_s)

    def frames(
        self, rng: np.random.Generator, start_s: float = 0.0
    ) -> Iterator[tuple[float, float | None]]:
        """Stamp and delivery (None: lost) of one frame after another, without end.

        Raises:
            SimError: without a frame rate.
        """
        if self.rate_hz is None:
            raise SimError("rate_hz must be given for a camera that runs on its own, got None")
        start = finite_number("start_s", start_s, SimError)
        number = 0
        while True:
            stamp_s = start + number / self.rate_hz
            yield stamp_s, self.delivery_s(stamp_s, rng)
            number += 1


class FrameClock:
    """Says at each tick of the simulation whether a frame is taken, and when it will arrive.

    A frame is taken at the first tick at or after its time.

    Args:
        timing: of the camera.
        rng: of losses and delays.
    """

    def __init__(self, timing: CameraTiming, rng: np.random.Generator) -> None:
        self._timing = timing
        self._rng = rng
        self._start_s: float | None = None
        self._next = 0

    def tick(self, now_s: float) -> tuple[bool, float | None]:
        """Whether a frame is taken now, and when it arrives (None: never)."""
        now = finite_number("now_s", now_s, SimError)
        rate_hz = self._timing.rate_hz
        if rate_hz is not None:
            if self._start_s is None:
                self._start_s = now
            passed = int((now - self._start_s + _EARLY_S) * rate_hz)
            if passed < self._next:
                return False, None
            self._next = passed + 1
        return True, self._timing.delivery_s(now, self._rng)


@dataclass(frozen=True, slots=True, order=True)
class _Waiting:
    delivery_s: float
    stamp_s: float
    number: int


class FrameQueue(Generic[FrameT]):
    """Frames on their way; hands each out once, when it has arrived.

    A frame knows its own capture stamp, however late it comes.
    """

    def __init__(self) -> None:
        self._waiting: list[_Waiting] = []
        self._frames: dict[int, FrameT] = {}
        self._count = 0

    def put(self, stamp_s: float, delivery_s: float | None, frame: FrameT) -> None:
        """Send a frame on its way; one that is lost (None) is forgotten at once."""
        if delivery_s is None:
            return
        stamp = finite_number("stamp_s", stamp_s, SimError)
        arrival = finite_number("delivery_s", delivery_s, SimError, minimum=stamp)
        heapq.heappush(self._waiting, _Waiting(arrival, stamp, self._count))
        self._frames[self._count] = frame
        self._count += 1

    def take(self, now_s: float) -> tuple[FrameT, ...]:
        """Every frame that has arrived by ``now_s``, in order of arrival."""
        out = []
        while self._waiting and self._waiting[0].delivery_s <= now_s + _EARLY_S:
            out.append(self._frames.pop(heapq.heappop(self._waiting).number))
        return tuple(out)

    def __len__(self) -> int:
        """How many frames are on their way."""
        return len(self._waiting)
