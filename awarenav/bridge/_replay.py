"""The bridge on a recording: the same work on recorded time, with nothing sent."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from nav_adapter import NavError
from nav_adapter.ros2 import AwarenessBridge, Topic
from nav_adapter.ros2.conversions import from_ros
from nav_adapter.ros2.messages import Message, ros_type
from nav_adapter.ros2.messages.geometry_msgs import PolygonStamped
from nav_adapter.ros2.messages.nav_msgs import OccupancyGrid, Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, CompressedImage, Image, LaserScan
from nav_adapter.ros2.messages.tf2_msgs import TFMessage

from ._loop import BridgeInputs, BridgeViewer, limit_text

if TYPE_CHECKING:
    from nav_adapter.ros2 import McapRecorder

    from ..estimate import BagMessages

_REPORT_PERIOD_S: Final = 2.0
# No message is so long on its way to the recorder, nor is a clock so far ahead of another's.
_LATEST_S: Final = 1.0
_AHEAD_S: Final = 0.05


class ReplayPublisher:
    """Records what the bridge would publish, at recorded times.

    Args:
        topics: the topics that are published, by key.
        recorder: takes the messages; None to make none.

    Attributes:
        now_s: the time of the recording.
    """

    def __init__(self, topics: Mapping[str, Topic], recorder: McapRecorder | None) -> None:
        self._topics, self._recorder = topics, recorder
        self.now_s = 0.0

    def wants(self, key: str) -> bool:
        """Return whether messages of this topic are recorded."""
        return self._recorder is not None and key in self._topics

    def publish(self, key: str, message: Message) -> None:
        """Record a message, unless its topic is left out."""
        if self._recorder is not None and key in self._topics:
            from nav_adapter.ros2 import encode  # noqa: PLC0415 - needs the extra ros2

            self._recorder.write(self._topics[key], encode(message), self.now_s)


def recorded_messages(path: Path, inputs: BridgeInputs) -> BagMessages:
    """Return the messages of the inputs in a recording.

    Raises:
        AwarenavError: for a file that is not a recording, or that lacks a topic.
    """
    from ..estimate import BagMessages  # noqa: PLC0415 - needs the extra rosbag

    topics = (
        inputs.image,
        inputs.depth,
        inputs.camera_info,
        inputs.odom,
        inputs.map,
        inputs.footprint,
        *inputs.scans,
    )
    optional = (inputs.tf, inputs.tf_static)
    required, others = (
        {f"/{topic.name}": ros_type(topic.message) for topic in group if topic is not None}
        for group in (topics, optional)
    )
    return BagMessages(path, required, others)


def static_transforms(
    messages: BagMessages, inputs: BridgeInputs, say: Callable[[str], None]
) -> tuple[tuple[str, float, Any], ...]:
    """Return the messages of static transforms, the earliest last.

    A recording whose transforms are on another topic is reported to ``say``.
    """
    if inputs.tf is None or inputs.tf_static is None:
        return ()
    kind = ros_type(inputs.tf.message)
    asked = {f"/{inputs.tf.name}", f"/{inputs.tf_static.name}"}
    have = {name for name, type_ in messages.topics if type_ == kind}
    if have and not have & asked:
        # Another robot's transforms would place the sensors wrongly without a word.
        roots = sorted({name.removesuffix("_static").strip("/") for name in have})
        own = [each for each in roots if _namespace(each) == _namespace(inputs.odom.name)]
        hint = own[0] if own else roots[0] if len(roots) == 1 else ""
        say(
            f"the recording has no /{inputs.tf.name}; it has {', '.join(sorted(have))}"
            + (f": --tf {hint}" if hint else "")
        )
    return tuple(messages.of([kind], f"/{inputs.tf_static.name}"))[::-1]


def _namespace(topic: str) -> str:
    return topic.rpartition("/")[0]


class BagReplay:
    """Passes recorded messages to a bridge, and publishes at a fixed rate of recorded time.

    Perception takes no time: its people count from the image's or the scan's arrival on.

    Args:
        messages: topic, time of recording (s) and message, in order.
        bridge: processes them.
        inputs: the topics that it reads.
        rate_hz: rate of publishing.
        publisher: is told the time.
        static: messages of static transforms, which hold for the whole recording: read first, the
            earliest last.
        viewer: shows the state of the bridge.

    Attributes:
        now_s: the time of the recording; None before its first message.
    """

    def __init__(
        self,
        messages: Iterable[tuple[str, float, Any]],
        bridge: AwarenessBridge,
        inputs: BridgeInputs,
        rate_hz: float,
        publisher: ReplayPublisher,
        *,
        static: Iterable[tuple[str, float, Any]] = (),
        viewer: BridgeViewer | None = None,
    ) -> None:
        self._messages, self._bridge, self._publisher = messages, bridge, publisher
        self._static = static
        stamped = (inputs.odom, inputs.image, inputs.depth, *inputs.scans)
        self._stamps = _Stamps({f"/{topic.name}" for topic in stamped if topic is not None})
        self._period_s, self._viewer = 1.0 / rate_hz, viewer
        self.now_s: float | None = None
        self._readers = self._readers_of(inputs)

    def run(
        self, seconds: float | None = None, *, report: Callable[[str], None] = lambda text: None
    ) -> float:
        """Replay all, or ``seconds`` of it; ``report`` gets a line every 2 s of recorded time.

        Return the time that was replayed, s.
        """
        began_s, ticks, reported_s = 0.0, 0, 0.0
        for name, recorded_s, message in self._static:
            self._read(name, message, recorded_s)
        for name, recorded_s, message in self._messages:
            if self.now_s is None:
                began_s = reported_s = recorded_s
            # Times of the recorder may go back a little; a tick is never repeated.
            while began_s + self._period_s * ticks <= recorded_s:
                tick_s = began_s + self._period_s * ticks
                # Not the difference of two times, which is rounded.
                if seconds is not None and self._period_s * ticks >= seconds:
                    return self._period_s * ticks
                self._tick(tick_s, report if tick_s - reported_s >= _REPORT_PERIOD_S else None)
                reported_s = tick_s if tick_s - reported_s >= _REPORT_PERIOD_S else reported_s
                ticks += 1
            self.now_s = recorded_s
            if (problem := self._stamps.problem(name, message, recorded_s)) is not None:
                report(problem)
            self._read(name, message, recorded_s)
        return 0.0 if self.now_s is None else self.now_s - began_s

    def _read(self, name: str, message: Any, recorded_s: float) -> None:
        try:
            self._readers[name](message, recorded_s)
        # A message of ROS 1 may have other fields.
        except (NavError, AttributeError, TypeError, ValueError) as problem:
            self._bridge.refuse(f"{name}: {problem}")

    def _tick(self, now_s: float, report: Callable[[str], None] | None) -> None:
        self.now_s = self._publisher.now_s = now_s
        constraints = self._bridge.tick(now_s)
        if self._viewer is not None:
            self._viewer.draw(self._bridge, constraints)
        if report is not None:
            report(f"{now_s:.1f} s  {limit_text(self._bridge, constraints)}")

    def _readers_of(self, inputs: BridgeInputs) -> dict[str, Callable[[Any, float], None]]:
        """Return by topic what is done with a message and its time."""
        bridge = self._bridge

        def image(message: Any, now_s: float) -> None:
            made: Image | CompressedImage
            if hasattr(message, "format"):
                made = from_ros(CompressedImage, message)
            else:
                made = from_ros(Image, message)
            if bridge.on_image(made, now_s) and self._viewer is not None:
                self._viewer.draw_frame(bridge)

        def depth(message: Any, now_s: float) -> None:
            bridge.on_depth(from_ros(Image, message), now_s)

        def footprint(message: Any, now_s: float) -> None:
            bridge.on_footprint(from_ros(PolygonStamped, message), now_s)

        def scan(number: int, message: Any, now_s: float) -> None:
            bridge.on_scan(number, from_ros(LaserScan, message), now_s)

        readers: dict[str, Callable[[Any, float], None]] = {
            f"/{inputs.odom.name}": lambda m, t: bridge.on_odometry(from_ros(Odometry, m), t)
        }
        optional: tuple[tuple[Topic | None, Callable[[Any, float], None]], ...] = (
            (inputs.image, image),
            (inputs.depth, depth),
            (inputs.camera_info, lambda m, t: bridge.on_camera_info(from_ros(CameraInfo, m))),
            (inputs.tf, lambda m, t: bridge.on_transforms(from_ros(TFMessage, m), t)),
            (
                inputs.tf_static,
                lambda m, t: bridge.on_transforms(from_ros(TFMessage, m), static=True),
            ),
            (inputs.map, lambda m, t: bridge.on_map(from_ros(OccupancyGrid, m))),
            (inputs.footprint, footprint),
            *((topic, partial(scan, number)) for number, topic in enumerate(inputs.scans)),
        )
        readers |= {f"/{topic.name}": read for topic, read in optional if topic is not None}
        return readers


class _Stamps:
    """Compares the stamps of messages with the times at which they were recorded.

    Args:
        topics: whose messages are compared.
    """

    def __init__(self, topics: set[str]) -> None:
        self._last_s = dict.fromkeys(topics, -math.inf)
        self._said: set[str] = set()

    def problem(self, name: str, message: Any, recorded_s: float) -> str | None:
        """Return the first problem of its kind in this recording."""
        if name not in self._last_s:
            return None
        stamp = message.header.stamp
        stamp_s = stamp.sec + 1e-9 * stamp.nanosec
        back_s, self._last_s[name] = self._last_s[name] - stamp_s, stamp_s
        behind_s = recorded_s - stamp_s
        if back_s > _LATEST_S:
            kind, text = (
                "back",
                f"go back by {back_s:.1f} s at {recorded_s:.1f} s, as in a recording of a replay "
                "in a loop or with a clock that was set back; until they are as late as before, "
                "the robot stops",
            )
        elif behind_s > _LATEST_S:
            kind, text = (
                "behind",
                f"are {behind_s:.1f} s behind the times of recording, as with simulated time that "
                "was recorded in real time (ros2 bag record --use-sim-time) or with another "
                "computer's clock; everything is too old, and the robot stops",
            )
        elif behind_s < -_AHEAD_S:
            kind, text = (
                "ahead",
                f"are {-behind_s:.3f} s ahead of the times of recording, as with another "
                "computer's clock; these messages are refused",
            )
        else:
            return None
        if kind in self._said or "back" in self._said:
            return None
        self._said.add(kind)
        return f"{name}: the stamps {text}"
