"""A thread for the bridge's scans, so that they delay no publication and wait for no network."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Final

from .._errors import NavError
from ._bridge import AwarenessBridge
from .messages.nav_msgs import OccupancyGrid
from .messages.sensor_msgs import LaserScan

# Scans that may wait: a tenth of a second of two scanners at 40 Hz.
_WAITING: Final = 8


class ScanThread:
    """Passes scans and maps to a bridge, in a thread of its own, in the order in which they came.

    If scans come faster than they are processed, the oldest are dropped and counted. Messages are
    given as functions, which decode the message in the thread. An error of the program does not end
    the thread; the bridge reports and counts it (:meth:`AwarenessBridge.perception_failed`).

    Args:
        bridge: its :meth:`~AwarenessBridge.tick` is called by another thread.
        clock: returns the present time, s.
    """

    def __init__(self, bridge: AwarenessBridge, clock: Callable[[], float]) -> None:
        self._bridge, self._clock = bridge, clock
        self._scans: deque[tuple[int, Callable[[], LaserScan]]] = deque()
        self._map: Callable[[], OccupancyGrid] | None = None
        self._closing = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="scans", daemon=True)
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

    def close(self, timeout_s: float = 5.0) -> bool:
        """End the thread after the message in hand; return False if that takes too long."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._map or self._scans)
                if self._closing:
                    return
                new_map, self._map = self._map, None
                scan = self._scans.popleft() if new_map is None else None
            try:
                if new_map is not None:
                    self._bridge.on_map(new_map())
                if scan is not None:
                    self._pass_on(*scan)
            except NavError as problem:
                self._bridge.refuse(str(problem))
            except Exception as problem:
                self._bridge.perception_failed(problem)

    def _pass_on(self, number: int, message: Callable[[], LaserScan]) -> None:
        try:
            scan = message()
        except NavError as problem:
            self._bridge.refuse_scan(number, str(problem), self._clock())
            return
        self._bridge.on_scan(number, scan, self._clock())
