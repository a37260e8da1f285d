"""The loop of the bridge: waits for messages, processes the newest frame, publishes at a rate."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol, cast

from nav_adapter import NavConstraints, NavError
from nav_adapter.ros2 import AwarenessBridge, Topic
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image
from nav_adapter.ros2.messages.tf2_msgs import TFMessage

if TYPE_CHECKING:
    from nav_adapter.ros2 import DdsNode, McapRecorder

_REPORT_PERIOD_S: Final = 2.0


class BridgeViewer(Protocol):
    """Shows or records the state of the bridge."""

    def draw(self, bridge: AwarenessBridge, constraints: NavConstraints, *, frame: bool) -> None:
        """Draw the state of the bridge; ``frame`` says whether it has a new image."""


@dataclass(frozen=True)
class BridgeInputs:
    """The topics that the bridge reads; None for an input that comes from a file."""

    image: Topic
    odom: Topic
    camera_info: Topic | None = None
    tf: Topic | None = None
    tf_static: Topic | None = None


class BridgeLoop:
    """Processes and publishes in one thread: a slow frame delays the next publication.

    Attributes:
        frames: number of frames that were processed.

    Args:
        node: receives and sends messages.
        bridge: processes the messages.
        inputs: the topics to read.
        rate_hz: rate of publishing without images; every image adds a publication.
        recorder: records odometry and tf as received.
        viewer: shows the state of the bridge.
    """

    def __init__(
        self,
        node: DdsNode,
        bridge: AwarenessBridge,
        inputs: BridgeInputs,
        rate_hz: float,
        *,
        recorder: McapRecorder | None = None,
        viewer: BridgeViewer | None = None,
    ) -> None:
        self._node, self._bridge, self._inputs = node, bridge, inputs
        self._period_s = 1.0 / rate_hz
        self._recorder, self._viewer = recorder, viewer
        self.frames = 0
        for topic in (inputs.image, inputs.odom, inputs.camera_info, inputs.tf, inputs.tf_static):
            if topic is not None:
                node.subscribe(topic)

    def run(
        self, seconds: float | None = None, *, report: Callable[[str], None] = lambda text: None
    ) -> None:
        """Run for ``seconds``, or until an exception; ``report`` gets a line every 2 s."""
        began = reported = due = time.monotonic()
        frames_before = 0
        while seconds is None or time.monotonic() - began < seconds:
            self._node.wait(due - time.monotonic())
            seen = self.take()
            if not seen and time.monotonic() < due:
                continue
            constraints = self._bridge.tick(time.time())
            if self._viewer is not None:
                self._viewer.draw(self._bridge, constraints, frame=seen)
            now = time.monotonic()
            due = now + self._period_s
            if now - reported >= _REPORT_PERIOD_S:
                rate_hz = (self.frames - frames_before) / (now - reported)
                report(
                    f"{rate_hz:4.1f} frames/s  {len(constraints.obstacles)} people  limit "
                    f"{constraints.speed_limit_mps:.2f} m/s ({constraints.limited_by})"
                )
                reported, frames_before = now, self.frames

    def take(self) -> bool:
        """Pass the received messages to the bridge; return whether a frame was processed."""
        inputs, bridge = self._inputs, self._bridge
        for message in self._messages(inputs.tf_static):
            bridge.on_transforms(cast(TFMessage, message), static=True)
        for message in self._messages(inputs.tf):
            bridge.on_transforms(cast(TFMessage, message))
        for message in self._messages(inputs.odom):
            bridge.on_odometry(cast(Odometry, message))
        for message in self._messages(inputs.camera_info, record=False):
            bridge.on_camera_info(cast(CameraInfo, message))
        good = False
        for message in self._messages(inputs.image, record=False):
            good |= bridge.on_image(cast(Image, message), time.time())
        self.frames += good
        return good

    def _messages(self, topic: Topic | None, *, record: bool = True) -> list[Message]:
        """Return the received messages of a topic; one that cannot be decoded is refused."""
        if topic is None:
            return []

        from nav_adapter.ros2 import decode  # noqa: PLC0415 - needs the extra ros2

        found = []
        for cdr in self._node.take_cdr(topic):
            try:
                found.append(decode(topic.message, cdr))
            except NavError as problem:
                self._bridge.refuse(f"/{topic.name}: {problem}")
                continue
            if record and self._recorder is not None:
                self._recorder.write(topic, cdr, time.time())
        return found
