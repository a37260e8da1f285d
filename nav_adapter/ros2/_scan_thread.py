"""A thread for the bridge's scans, so that they delay no publication and wait for no network."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Final

from .._errors import NavError
from ._bridge import AwarenessBridge
from ._message_thread import MessageThread
from .messages.nav_msgs import OccupancyGrid
from .messages.sensor_msgs import LaserScan

# Scans that may wait: a tenth of a second of two scanners at 40 Hz.
_WAITING: Final = 8


class ScanThread(MessageThread):
    """Passes scans and maps to a bridge, in a thread of its own, in the order in which they came.

    If scans come faster than they are processed, the oldest are dropped and counted. Messages are
    given as functions, which decode the message in the thread. An error of the program does not end
    the thread; the bridge reports and counts it (:meth:`AwarenessBridge.perception_failed`).

    Args:
        bridge: its :meth:`~AwarenessBridge.tick` is called by another thread.
        clock: returns the present time, s.
    """

    def __init__(self, bridge: AwarenessBridge, clock: Callable[[], float]) -> None:
        super().__init__(bridge, "scans")
        self._clock = clock
        self._scans: deque[tuple[int, Callable[[], LaserScan]]] = deque()
        self._map: Callable[[], OccupancyGrid] | None = None
        self._thread.start()

    def submit(self, number: int, message: Callable[[], LaserScan]) -> None:
        """Hand over a scan of a scanner, numbered from 0; return at once."""
        with self._changed:
            self._scans.append((number, message))
            too_many = len(self._scans) > _WAITING
            if too_many:
                self._scans.popleft()
            self._changed.notify()
        if too_many:
            self._bridge.scan_dropped()

    def submit_map(self, message: Callable[[], OccupancyGrid]) -> None:
        """Hand over a map, which replaces one that is still waiting; return at once."""
        with self._changed:
            self._map = message
            self._changed.notify()

    def _is_waiting(self) -> bool:
        return self._map is not None or bool(self._scans)

    def _take(self) -> Callable[[], None]:
        new_map, self._map = self._map, None
        if new_map is not None:
            return partial(self._pass_on_map, new_map)
        return partial(self._pass_on, *self._scans.popleft())

    def _pass_on_map(self, message: Callable[[], OccupancyGrid]) -> None:
        self._bridge.on_map(message())

    def _pass_on(self, number: int, message: Callable[[], LaserScan]) -> None:
        try:
            scan = message()
        except NavError as problem:
            self._bridge.refuse_scan(number, str(problem), self._clock())
            return
        self._bridge.on_scan(number, scan, self._clock())
