"""The parts that the inputs of the bridge share, and the one path of refusing a message."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from ._clock import BridgeClock
from ._poses import RobotPoses
from ._sensor_watch import SensorWatch
from ._shared_tracker import SharedTracker

# A sensor whose messages are refused is reported again after this time.
_WARN_AGAIN_S: Final = 10.0


@dataclass(frozen=True)
class Shared:
    """The parts that the inputs of a bridge share.

    Attributes:
        clock: of the bridge; used under the lock.
        poses: of robot and sensors; used under the lock.
        watch: of the sensors; used under the lock.
        tracker: takes the people of all sensors, and has a lock of its own.
        lock: guards what is shared with other threads.
        warn: called with each problem.
    """

    clock: BridgeClock
    poses: RobotPoses
    watch: SensorWatch
    tracker: SharedTracker
    lock: threading.RLock
    warn: Callable[[str], object]


class Refusals:
    """Counts the messages of a sensor that cannot be used, and reports one in 10 s.

    Args:
        shared: by the inputs.
        what: such a message, in words.
    """

    def __init__(self, shared: Shared, what: str) -> None:
        self._shared, self._what = shared, what
        self._warned_s = -math.inf
        self.count = 0

    def add(self, problem: str, now_s: float) -> None:
        """Count a message, and report it if none was lately."""
        with self._shared.lock:
            self.count += 1
            if 0.0 <= now_s - self._warned_s < _WARN_AGAIN_S:
                return
            self._warned_s = now_s
        self._shared.warn(f"{self._what} refused and counted: {problem}")

    def forget(self) -> None:
        """Report the next one; called with the lock."""
        self._warned_s = -math.inf
