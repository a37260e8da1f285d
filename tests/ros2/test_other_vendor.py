"""Every topic, between this project's DDS (Cyclone) and ROS 2's (rclpy, Fast DDS)."""

from __future__ import annotations

import time
from typing import Any

from bridge_scenes import INFO, image, odometry, tf
from conftest import qos, until
from ros2_scenes import everything
from scan_scenes import planar, scan_message

from nav_adapter.ros2 import MASK_TOPICS, PUBLISHED, READ, DdsNode, decode, encode
from nav_adapter.ros2.conversions import from_ros, header, ros_class, to_ros
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages import geometry_msgs as geometry
from nav_adapter.ros2.messages.nav2_msgs import CostmapFilterInfo
from nav_adapter.ros2.messages.sensor_msgs import CompressedImage, Image

STAMP_S = 1000.25
# On one computer the news takes milliseconds.
GONE_S = 0.5
OUTLINE = geometry.Polygon(tuple(geometry.Point32(x, y) for x, y in ((0.5, 0.0), (-0.5, 0.3))))
SENT = {
    "image": image(STAMP_S),
    "compressed": CompressedImage(header(STAMP_S, "camera"), "png", bytes(range(256))),
    "depth": Image(header(STAMP_S, "camera"), 2, 3, "16UC1", 0, 6, bytes(range(12))),
    "camera_info": INFO,
    "scan": scan_message(STAMP_S),
    "scan_2": scan_message(STAMP_S + 0.1),
    "map": dict(everything())["grid"],
    "footprint": geometry.PolygonStamped(header(STAMP_S, "odom"), OUTLINE),
    "odom": odometry(STAMP_S, 1.0, 0.3),
    "tf": tf("odom", "base_link", planar(1.0, 2.0, 0.3)),
    "tf_static": tf("base_link", "scanner", planar(0.3)),
}
MASKS = {
    "speed_mask": SENT["map"],
    "speed_mask_info": CostmapFilterInfo(filter_mask_topic="/awarenav/speed_mask", multiplier=1.0),
}


def rounded(message: Message) -> Message:
    """Return a message as it arrives: some fields are in single precision."""
    return decode(type(message), encode(message))


def test_publishers_of_ros_come_leave_and_come_again(peer: Any, node: DdsNode) -> None:
    for topic in READ.values():
        node.subscribe(topic)
    for _ in range(2):
        publishers = {
            key: peer.create_publisher(ros_class(topic.message), topic.name, qos(topic))
            for key, topic in READ.items()
        }
        heard: dict[str, Message] = {}

        def all_heard(heard: dict = heard, publishers: dict = publishers) -> bool:
            for key in READ.keys() - heard.keys():
                publishers[key].publish(to_ros(SENT[key]))
            node.wait(0.05)
            for key, topic in READ.items():
                heard.update((key, message) for message in node.take(topic))
            return len(heard) == len(READ)

        until(all_heard)
        assert heard == {key: rounded(message) for key, message in SENT.items()}
        while node.wait(0.3):  # what was published again before it was heard
            for topic in READ.values():
                node.take(topic)
        for publisher in publishers.values():
            peer.destroy_publisher(publisher)
        # DDS wakes a reader for the news that its last publisher has left, which is no message.
        assert until(lambda: node.wait(0.1))
        end = time.monotonic() + GONE_S
        while time.monotonic() < end:
            assert not any(node.take(topic) for topic in READ.values())
            node.wait(0.05)


def test_readers_of_ros_hear_every_topic(peer: Any, node: DdsNode) -> None:
    import rclpy  # noqa: PLC0415 - skipped without it

    topics, messages = {**PUBLISHED, **MASK_TOPICS}, {**dict(everything()), **MASKS}
    heard: dict[str, Message] = {}
    for key, topic in topics.items():
        node.advertise(topic)
        if topic.transient_local:  # its reader comes late
            node.publish(topic, messages[key])
        kind = type(messages[key])

        def hear(message: Any, key: str = key, kind: type = kind) -> None:
            heard[key] = from_ros(kind, message)

        peer.create_subscription(ros_class(kind), topic.name, hear, qos(topic))

    def all_heard() -> bool:
        for key in topics.keys() - heard.keys():
            if not topics[key].transient_local:
                node.publish(topics[key], messages[key])
        for _ in topics:
            rclpy.spin_once(peer, timeout_sec=0.01)
        return len(heard) == len(topics)

    until(all_heard)
    assert heard == {key: rounded(messages[key]) for key in topics}
