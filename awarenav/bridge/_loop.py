"""The loop of the bridge: wait for messages, work the newest frame, publish at a rate."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, cast

from nav_adapter import NavConstraints, NavError
from nav_adapter.ros2 import AwarenessBridge, Topic
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image
from nav_adapter.ros2.messages.tf2_msgs import TFMessage

if TYPE_CHECKING:
    from nav_adapter.ros2 import DdsNode, McapRecorder

_REPORT_S = 2.0


class FrameSink(Protocol):
    """What draws frames and constraints."""

    def draw(self, bridge: AwarenessBridge, constraints: NavConstraints, *, frame: bool) -> None:
        """Draw the state of the bridge; ``frame`` when a new picture is in it."""


@dataclass(frozen=True)
class Inputs:
    """The topics that are read; None for what comes from a file."""

    image: Topic
    odom: Topic
    camera_info: Topic | None = None
    tf: Topic | None = None
    tf_static: Topic | None = None


class BridgeLoop:
    """One thread: a frame that takes long delays the next publication, and never two at a time.

    Args:
        node: takes and publishes.
        bridge: works.
        inputs: what is read.
        rate_hz: how often everything is published without images; each image adds one.
        recorder: gets odometry and tf as they were read.
        drawing: draws.
    """

    def __init__(
        self,
        node: DdsNode,
        bridge: AwarenessBridge,
        inputs: Inputs,
        rate_hz: float,
        *,
        recorder: McapRecorder | None = None,
        drawing: FrameSink | None = None,
    ) -> None:
        self._node, self._bridge, self._inputs = node, bridge, inputs
        self._period_s = 1.0 / rate_hz
        self._recorder, self._drawing = recorder, drawing
        #: Good frames so far.
        self.frames = 0
        for topic in (inputs.image, inputs.odom, inputs.camera_info, inputs.tf, inputs.tf_static):
            if topic is not None:
                node.subscribe(topic)

    def run(
        self, seconds: float | None = None, *, report: Callable[[str], None] = lambda text: None
    ) -> None:
        """Run for so long, or until an exception ends it; report every two seconds."""
        began = reported = due = time.monotonic()
        frames_before = 0
        while seconds is None or time.monotonic() - began < seconds:
            self._node.wait(due - time.monotonic())
            seen = self.take()
            if not seen and time.monotonic() < due:
                continue
            constraints = self._bridge.tick(time.time())
            if self._drawing is not None:
                self._drawing.draw(self._bridge, constraints, frame=seen)
            now = time.monotonic()
            due = now + self._period_s
            if now - reported >= _REPORT_S:
                rate_hz = (self.frames - frames_before) / (now - reported)
                report(
                    f"{rate_hz:4.1f} frames/s  {len(constraints.obstacles)} people  limit "
                    f"{constraints.speed_limit_mps:.2f} m/s ({constraints.limited_by})"
                )
                reported, frames_before = now, self.frames

    def take(self) -> bool:
        """Hand over what has come; True when a good frame was in it."""
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
