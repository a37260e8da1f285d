"""Threads for the bridge's perception, so that slow networks and scans delay no publication."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeAlias

from .._errors import NavError
from ._bridge import AwarenessBridge
from .messages.nav_msgs import OccupancyGrid
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image, LaserScan

AnyImage: TypeAlias = Image | CompressedImage


class MessageThread:
    """A thread that passes waiting messages to a bridge, one after the other.

    Messages are given as functions, which decode the message in the thread. An error of the program
    does not end it. The bridge reports and counts it (:meth:`AwarenessBridge.perception_failed`),
    publishes on with older and older people until it stops the robot, and the next message is
    tried.

    ``most_waiting`` messages of each kind may wait, the most urgent kind first. The oldest ones are
    dropped for new ones.
    """

    def __init__(
        self,
        bridge: AwarenessBridge,
        clock: Callable[[], float],
        name: str,
        most_waiting: Mapping[str, int],
    ) -> None:
        self._bridge, self._clock = bridge, clock
        self._waiting: dict[str, deque[Callable[[], None]]] = {
            kind: deque(maxlen=most) for kind, most in most_waiting.items()
        }
        self._closing = False
        self._changed = threading.Condition()
        # A network that hangs must not keep the process from ending.
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def close(self, timeout_s: float = 5.0) -> bool:
        """End the thread after the message in hand; return False if that takes too long."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _hand_over(self, kind: str, pass_on: Callable[[], None]) -> bool:
        """Add what passes a message on; return True if an older message was dropped for it."""
        with self._changed:
            waiting = self._waiting[kind]
            is_full = len(waiting) == waiting.maxlen
            waiting.append(pass_on)
            self._changed.notify()
        return is_full

    def _use(
        self,
        message: Callable[[], Any],
        use: Callable[[Any, float], object],
        refuse: Callable[[str, float], None],
    ) -> None:
        """Pass a message on with the time, or why it cannot be decoded."""
        try:
            decoded = message()
        except NavError as problem:
            refuse(str(problem), self._clock())
        else:
            use(decoded, self._clock())

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or any(self._waiting.values()))
                if self._closing:
                    return
                pass_on = next(each for each in self._waiting.values() if each).popleft()
            try:
                pass_on()
            except NavError as problem:
                self._bridge.refuse(str(problem))
            except Exception as problem:
                self._bridge.perception_failed(problem)


class PerceptionThread(MessageThread):
    """Passes calibrations and images to a bridge, in a thread of its own (:class:`MessageThread`).

    Depth images go first, of which the newest few wait. Only the newest image waits while another
    one is processed, and only the newest calibration; a calibration goes before an image.

    Args:
        bridge: its :meth:`~AwarenessBridge.tick` is called by another thread.
        clock: returns the present time, s.
        on_frame: called in the thread after each frame that was used.
    """

    def __init__(
        self,
        bridge: AwarenessBridge,
        clock: Callable[[], float],
        *,
        on_frame: Callable[[], None] = lambda: None,
    ) -> None:
        self._on_frame = on_frame
        # Four depth images are a tenth of a second at 30 Hz; the newest is that of the newest
        # picture.
        super().__init__(bridge, clock, "perception", {"depth": 4, "calibration": 1, "image": 1})

    def calibrate(self, message: Callable[[], CameraInfo]) -> None:
        """Hand over a calibration; return at once."""
        self._hand_over("calibration", lambda: self._bridge.on_camera_info(message()))

    def submit(self, message: Callable[[], AnyImage]) -> None:
        """Hand over an image, which replaces one that is still waiting; return at once."""
        self._hand_over("image", partial(self._pass_on_image, message))

    def submit_depth(self, message: Callable[[], Image]) -> None:
        """Hand over a depth image; return at once."""
        bridge = self._bridge
        self._hand_over("depth", lambda: self._use(message, bridge.on_depth, bridge.refuse_depth))

    def _pass_on_image(self, message: Callable[[], AnyImage]) -> None:
        if self._bridge.on_image(message(), self._clock()):
            self._on_frame()


class ScanThread(MessageThread):
    """Passes scans and maps to a bridge in a thread of its own, in the order in which they came.

    If scans come faster than they are processed, the oldest are dropped and counted.

    Args:
        bridge: its :meth:`~AwarenessBridge.tick` is called by another thread.
        clock: returns the present time, s.
    """

    def __init__(self, bridge: AwarenessBridge, clock: Callable[[], float]) -> None:
        # Eight scans are a tenth of a second of two scanners at 40 Hz.
        super().__init__(bridge, clock, "scans", {"map": 1, "scan": 8})

    def submit(self, number: int, message: Callable[[], LaserScan]) -> None:
        """Hand over a scan of a scanner, numbered from 0; return at once."""
        bridge = self._bridge
        use, refuse = partial(bridge.on_scan, number), partial(bridge.refuse_scan, number)
        if self._hand_over("scan", lambda: self._use(message, use, refuse)):
            bridge.scan_dropped()

    def submit_map(self, message: Callable[[], OccupancyGrid]) -> None:
        """Hand over a map, which replaces one that is still waiting; return at once."""
        self._hand_over("map", lambda: self._bridge.on_map(message()))
