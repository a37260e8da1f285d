"""Depth images of the bridge: kept until the picture of their time comes."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from numpy.typing import NDArray

from perception.depth_image import MOST_APART_S

from .._errors import NavError
from ._clock import BridgeClock
from ._images import depth_of
from ._sensor_watch import SensorWatch
from .conversions import to_seconds
from .messages.sensor_msgs import Image

# Depth images that are kept: a quarter of a second at 30 Hz.
_KEPT: Final = 8
# A camera whose depth images are refused is reported again after this time.
_WARN_AGAIN_S: Final = 10.0


@dataclass(frozen=True, eq=False)
class StampedDepth:
    """A depth image.

    Attributes:
        stamp_s: its time.
        depth: (H, W) uint16 millimetres or float32 metres.
    """

    stamp_s: float
    depth: NDArray[Any]


class DepthReader:
    """Keeps the latest depth images, and gives each picture the one nearest to it in time.

    A depth image that cannot be used is refused, counted and reported; the picture is then seen
    without. Only one that perception has used counts as heard.

    Args:
        clock: of the bridge; used under the lock.
        watch: of the sensors; used under the lock.
        lock: guards what is shared with other threads.
        warn: called with each problem.
    """

    def __init__(
        self,
        clock: BridgeClock,
        watch: SensorWatch,
        lock: threading.RLock,
        warn: Callable[[str], object],
    ) -> None:
        self._clock, self._watch, self._lock, self._warn = clock, watch, lock, warn
        self._kept: deque[StampedDepth] = deque(maxlen=_KEPT)
        self._warned_s = -math.inf
        self._used = self._refused = 0

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of depth images that were used, and refused."""
        return {"depth_images": self._used, "depth_images_refused": self._refused}

    def read(self, message: Image, now_s: float) -> bool:
        """Keep a depth image; return False if it was refused."""
        stamp_s = to_seconds(message.header.stamp)
        try:
            depth = depth_of(message)
            with self._lock:
                refusal = self._clock.refusal("depth_images", stamp_s, now_s)
                if refusal is not None:
                    raise NavError(f"its {refusal}")
                self._kept.append(StampedDepth(stamp_s, depth))
        except NavError as problem:
            self.refuse(str(problem), now_s)
            return False
        return True

    def nearest(self, stamp_s: float) -> StampedDepth | None:
        """Return the depth image of a picture; None if none is near enough in time."""
        with self._lock:
            found = min(self._kept, key=lambda each: abs(each.stamp_s - stamp_s), default=None)
        if found is None or abs(found.stamp_s - stamp_s) > MOST_APART_S:
            return None
        return found

    def refuse(self, problem: str, now_s: float) -> None:
        """Count a depth image that cannot be used, and report it if none was lately."""
        with self._lock:
            self._refused += 1
            if 0.0 <= now_s - self._warned_s < _WARN_AGAIN_S:
                return
            self._warned_s = now_s
        self._warn(f"depth image refused and counted: {problem}")

    def used(self, depth: StampedDepth) -> None:
        """Note a depth image that perception has used; called with the lock."""
        self._used += 1
        self._watch.saw_depth(depth.stamp_s)

    def forget(self) -> None:
        """Forget all depth images; called with the lock."""
        self._kept.clear()
        self._warned_s = -math.inf
