"""A thread for the bridge's perception, so that slow networks delay no publication."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Final, TypeAlias

from .._errors import NavError
from ._bridge import AwarenessBridge
from ._message_thread import MessageThread
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image

AnyImage: TypeAlias = Image | CompressedImage
# A tenth of a second at 30 Hz; the newest are those of the newest picture.
_WAITING_DEPTHS: Final = 4


class PerceptionThread(MessageThread):
    """Passes calibrations and images to a bridge, in a thread of its own.

    Depth images go first, of which the newest few wait. Only the newest image waits while another
    one is processed, and only the newest calibration; a calibration goes before an image. All are
    given as functions, which decode the message in the thread.

    An error of the program in perception does not end the thread. The bridge reports and counts it
    (:meth:`AwarenessBridge.perception_failed`), publishes on with older and older people until it
    stops the robot, and the next image is tried.

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
        super().__init__(bridge, "perception")
        self._clock, self._on_frame = clock, on_frame
        self._calibration: Callable[[], CameraInfo] | None = None
        self._image: Callable[[], AnyImage] | None = None
        self._depths: deque[Callable[[], Image]] = deque(maxlen=_WAITING_DEPTHS)
        self._thread.start()

    def calibrate(self, message: Callable[[], CameraInfo]) -> None:
        """Hand over a calibration; return at once."""
        with self._changed:
            self._calibration = message
            self._changed.notify()

    def submit(self, message: Callable[[], AnyImage]) -> None:
        """Hand over an image, which replaces one that is still waiting; return at once."""
        with self._changed:
            self._image = message
            self._changed.notify()

    def submit_depth(self, message: Callable[[], Image]) -> None:
        """Hand over a depth image; return at once."""
        with self._changed:
            self._depths.append(message)
            self._changed.notify()

    def _is_waiting(self) -> bool:
        return self._calibration is not None or self._image is not None or bool(self._depths)

    def _take(self) -> Callable[[], None]:
        if self._depths:
            return partial(self._pass_on_depth, self._depths.popleft())
        calibration, self._calibration = self._calibration, None
        image = None
        if calibration is None:
            image, self._image = self._image, None
        return partial(self._pass_on, calibration, image)

    def _pass_on_depth(self, message: Callable[[], Image]) -> None:
        try:
            depth = message()
        except NavError as problem:
            self._bridge.refuse_depth(str(problem), self._clock())
            return
        self._bridge.on_depth(depth, self._clock())

    def _pass_on(
        self, calibration: Callable[[], CameraInfo] | None, image: Callable[[], AnyImage] | None
    ) -> None:
        if calibration is not None:
            self._bridge.on_camera_info(calibration())
        if image is not None and self._bridge.on_image(image(), self._clock()):
            self._on_frame()
