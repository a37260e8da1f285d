"""The parts that the inputs of the bridge share, and the one path of a message into them."""

from __future__ import annotations

import math
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from perception import PerceptionError
from perception.no_view import LastFrames
from tracking import TrackingError

from .._errors import NavError
from ._clock import BridgeClock
from ._poses import RobotPoses
from ._sensor_watch import SensorWatch
from ._shared_tracker import SharedTracker

# A sensor whose messages are refused is reported again after this time.
_WARN_AGAIN_S: Final = 10.0


@dataclass(frozen=True)
class Shared:
    """The parts that the inputs of a bridge share.

    Clock, poses and watch are used under the lock; the tracker has a lock of its own. ``warn`` is
    called with each problem.
    """

    clock: BridgeClock
    poses: RobotPoses
    watch: SensorWatch
    tracker: SharedTracker
    lock: threading.RLock
    warn: Callable[[str], object]

    def still_current(self) -> Callable[[], bool]:
        """Return what tells later whether the clock has not been set since; call with the lock."""
        restarts = self.clock.restarts
        return lambda: self.clock.restarts == restarts


class Input(ABC):
    """The messages of one sensor: each is used, or refused, counted and reported once in 10 s.

    ``used`` and ``refused`` are their numbers; ``what`` is such a message in words.
    """

    def __init__(self, shared: Shared, what: str) -> None:
        self._shared, self._what = shared, what
        self._last = LastFrames()
        self._warned_s = -math.inf
        self.used = self.refused = 0

    def read(self, message: Any, now_s: float) -> bool:
        """Use a message; return False if it was refused, or has come too late."""
        try:
            return self._use(message, now_s)
        except (NavError, PerceptionError, TrackingError) as problem:
            self.refuse(str(problem), now_s)
        return False

    def refuse(self, problem: str, now_s: float) -> None:
        """Count a message that cannot be used, and report it if none was lately."""
        with self._shared.lock:
            self.refused += 1
            if 0.0 <= now_s - self._warned_s < _WARN_AGAIN_S:
                return
            self._warned_s = now_s
        self._shared.warn(f"{self._what} refused and counted: {problem}")

    def forget(self) -> None:
        """Forget what has a stamp of the clock before it was set; called with the lock."""
        self._warned_s = -math.inf

    @abstractmethod
    def _use(self, message: Any, now_s: float) -> bool:
        """Use a message as :meth:`read` says.

        Raises:
            NavError, PerceptionError, TrackingError: for one that cannot be used.
        """
