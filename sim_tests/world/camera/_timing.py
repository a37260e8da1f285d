"""Frame timing: capture, loss and delayed delivery of a camera's frames."""

from __future__ import annotations

import heapq
from typing import Final, Generic, TypeVar

import numpy as np
from pydantic import Field

from perception.arrays import finite_number

from ..config import SimConfig
from ..errors import SimError

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

    Args:
        timing: timing of the camera.
        rng: draws losses and delays.
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
