"""The bridge over DDS: passes messages on, and publishes at a fixed rate."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol, TypeVar, cast

from nav_adapter import NavConstraints, NavError
from nav_adapter.ros2 import AwarenessBridge, PerceptionThread, ScanThread, Topic, is_rectified
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.geometry_msgs import PolygonStamped
from nav_adapter.ros2.messages.nav_msgs import OccupancyGrid, Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image, LaserScan
from nav_adapter.ros2.messages.tf2_msgs import TFMessage

from ..errors import counted

if TYPE_CHECKING:
    from nav_adapter.ros2 import DdsNode, McapRecorder

_REPORT_PERIOD_S: Final = 2.0
# So that no queue of poses overflows at a low rate of publishing.
_LONGEST_WAIT_S: Final = 0.05

# A publisher has been found by then, and has sent its last message.
_LATCHED_AFTER_S: Final = 5.0

_Message = TypeVar("_Message", bound=Message)


class BridgeViewer(Protocol):
    """Shows or records the state of the bridge."""

    def draw(self, bridge: AwarenessBridge, constraints: NavConstraints) -> None:
        """Draw constraints, in the thread that publishes."""

    def draw_frame(self, bridge: AwarenessBridge) -> None:
        """Draw the latest frame, in the thread of perception."""


@dataclass(frozen=True)
class BridgeInputs:
    """The topics that the bridge reads; None for an input that is not there, or is in a file."""

    image: Topic | None
    odom: Topic
    camera_info: Topic | None = None
    tf: Topic | None = None
    tf_static: Topic | None = None
    scans: tuple[Topic, ...] = ()
    map: Topic | None = None
    depth: Topic | None = None
    footprint: Topic | None = None

    @property
    def rectified(self) -> bool:
        """True if the images are rectified, by the name of their topic."""
        return self.image is not None and is_rectified(self.image.name)


def limit_text(bridge: AwarenessBridge, constraints: NavConstraints) -> str:
    """Return the number of people, the limit with its reason, and the one that Nav2 gets."""
    people = counted(len(constraints.obstacles), "person", "people")
    return (
        f"{people}  limit {constraints.speed_limit_mps:.2f} m/s ({constraints.limited_by}), "
        f"sent {bridge.sent_limit_mps(constraints):.2f}"
    )


class TopicPublisher:
    """Publishes messages over DDS, and records what it publishes.

    Args:
        node: gets a publisher for each topic.
        topics: the topics that are published, by key.
        recorder: records every message, if there is one.
    """

    def __init__(
        self, node: DdsNode, topics: Mapping[str, Topic], recorder: McapRecorder | None
    ) -> None:
        self._node, self._topics, self._recorder = node, topics, recorder
        for topic in topics.values():
            node.advertise(topic)

    def wants(self, key: str) -> bool:
        """Return whether a message of this topic would be received or recorded.

        A message of a latched topic is always wanted, since later subscribers get the last one.
        """
        topic = self._topics.get(key)
        return topic is not None and (
            self._recorder is not None or topic.transient_local or self._node.readers_of(topic) > 0
        )

    def publish(self, key: str, message: Message) -> None:
        """Publish a message, unless its topic is left out."""
        topic = self._topics.get(key)
        if topic is not None:
            cdr = self._node.publish(topic, message)
            if self._recorder is not None:
                self._recorder.write(topic, cdr, time.time())


class BridgeLoop:
    """Publishes at a fixed rate, whatever perception takes, which has threads of its own.

    A late publication is made up for by one that follows at once; more are left out.

    Attributes:
        frames: number of frames that were processed.

    Args:
        node: receives and sends messages.
        bridge: processes the messages.
        inputs: the topics to read.
        rate_hz: rate of publishing.
        recorder: records odometry, tf and scans as received.
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
        for topic in (inputs.depth, inputs.image, inputs.camera_info, *inputs.scans):
            if topic is not None:
                node.subscribe(topic)
        # Poses are read before each image and each publication. On busy cores, waking for each of
        # them would cost the networks more time than reading them.
        for topic in (inputs.odom, inputs.tf, inputs.tf_static, inputs.map, inputs.footprint):
            if topic is not None:
                node.subscribe(topic, wakes=False)
        self._perception = PerceptionThread(bridge, time.time, on_frame=self._on_frame)
        self._scans = ScanThread(bridge, time.time) if inputs.scans else None
        once = inputs.map, inputs.tf_static, inputs.footprint
        self._unheard = [topic for topic in once if topic is not None]

    def run(
        self, seconds: float | None = None, *, report: Callable[[str], None] = lambda text: None
    ) -> None:
        """Run for ``seconds``, or until an exception; ``report`` gets a line every 2 s."""
        began = reported = due = time.monotonic()
        before = 0
        while seconds is None or time.monotonic() - began < seconds:
            self._node.wait(min(due - time.monotonic(), _LONGEST_WAIT_S))
            self._take()
            if time.monotonic() < due:
                continue
            constraints = self._bridge.tick(time.time())
            if self._viewer is not None:
                self._viewer.draw(self._bridge, constraints)
            now = time.monotonic()
            if self._unheard and now - began >= _LATCHED_AFTER_S:
                self._report_unheard(report)
            due = max(due + self._period_s, now)
            if now - reported >= _REPORT_PERIOD_S:
                total = self._processed
                report(
                    f"{(total - before) / (now - reported):4.1f} frames/s  "
                    f"{limit_text(self._bridge, constraints)}"
                )
                reported, before = now, total

    def _report_unheard(self, report: Callable[[str], None]) -> None:
        """Say once which topics that need not be sent again have sent nothing, and why."""
        for topic in self._unheard:
            if topic is self._inputs.footprint:
                report(f"no footprint yet on /{topic.name}: that of the robot file holds")
            elif self._node.has_unfit_publisher(topic):
                report(
                    f"nothing comes from the publisher of /{topic.name}: its durability is "
                    "volatile or its reliability best_effort; they must be transient_local and "
                    "reliable"
                )
            elif topic is self._inputs.map:
                report(
                    f"no map yet on /{topic.name} after {_LATCHED_AFTER_S:g} s: is its publisher "
                    "running, with the durability transient_local?"
                )
        self._unheard.clear()

    @property
    def _processed(self) -> int:
        """Number of images, or of scans if there is no camera."""
        return self.frames if self._inputs.image is not None else self._bridge.counts["scans"]

    def close(self) -> bool:
        """End perception after the frames in hand; return False if that takes too long."""
        ended = self._scans is None or self._scans.close()
        return self._perception.close() and ended

    def _take(self) -> None:
        """Pass the received messages on, an image after the poses that came before it."""
        inputs, bridge = self._inputs, self._bridge
        for transforms in self._messages(inputs.tf_static, TFMessage):
            bridge.on_transforms(transforms, static=True)
        for transforms in self._messages(inputs.tf, TFMessage):
            bridge.on_transforms(transforms, time.time())
        for odometry in self._messages(inputs.odom, Odometry):
            bridge.on_odometry(odometry, time.time())
        for footprint in self._messages(inputs.footprint, PolygonStamped):
            bridge.on_footprint(footprint, time.time())
        if inputs.camera_info is not None:
            # Taken even if it is not needed: waiting ends at once while a message is left.
            for cdr in self._node.take_cdr(inputs.camera_info)[-1:]:
                if bridge.camera is None:
                    self._perception.calibrate(self._decoder(inputs.camera_info, cdr, CameraInfo))
        if inputs.depth is not None:
            for cdr in self._node.take_cdr(inputs.depth):
                self._perception.submit_depth(self._decoder(inputs.depth, cdr, Image))
        if inputs.image is not None:
            for cdr in self._node.take_cdr(inputs.image)[-1:]:
                self._perception.submit(self._decoder(inputs.image, cdr, Image))
        if self._scans is not None:
            self._take_scans(self._scans)

    def _take_scans(self, thread: ScanThread) -> None:
        """Pass the received map and scans on."""
        if self._inputs.map is not None:
            for cdr in self._node.take_cdr(self._inputs.map)[-1:]:
                self._heard(self._inputs.map)
                thread.submit_map(self._decoder(self._inputs.map, cdr, OccupancyGrid))
        for number, topic in enumerate(self._inputs.scans):
            for cdr in self._node.take_cdr(topic):
                thread.submit(number, self._decoder(topic, cdr, LaserScan))
                if self._recorder is not None:
                    self._recorder.write(topic, cdr, time.time())

    def _messages(self, topic: Topic | None, kind: type[_Message]) -> list[_Message]:
        """Return and record the messages of a topic; one that cannot be decoded is refused."""
        found: list[_Message] = []
        if topic is None:
            return found
        for cdr in self._node.take_cdr(topic):
            self._heard(topic)
            try:
                found.append(self._decoder(topic, cdr, kind)())
            except NavError as problem:
                self._bridge.refuse(str(problem))
                continue
            if self._recorder is not None:
                self._recorder.write(topic, cdr, time.time())
        return found

    def _heard(self, topic: Topic) -> None:
        if topic in self._unheard:
            self._unheard.remove(topic)

    def _decoder(self, topic: Topic, cdr: bytes, kind: type[_Message]) -> Callable[[], _Message]:
        """Return a function that decodes a message, or raises NavError with the topic's name."""
        from nav_adapter.ros2 import decode  # noqa: PLC0415 - needs the extra ros2

        def message() -> _Message:
            try:
                return cast(_Message, decode(topic.message, cdr))
            except NavError as problem:
                raise NavError(f"/{topic.name}: {problem}") from problem

        return message

    def _on_frame(self) -> None:
        """Count and draw a frame, in the thread of perception."""
        self.frames += 1
        if self._viewer is not None:
            self._viewer.draw_frame(self._bridge)
