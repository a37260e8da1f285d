"""The node on a recording: ``python node_in_lockstep.py RECORDING OUT RATE_HZ --ros-args …``.

Plays a recording over DDS, with its time as simulated time, and waits for each message to be
processed. OUT gets what rclpy's subscribers hear, as JSON: a list of topic key and the bytes of the
message in hexadecimal.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rosbags.highlevel import AnyReader
from rosgraph_msgs.msg import Clock

from nav_adapter.ros2 import PUBLISHED, READ, AwarenessBridge, decode
from nav_adapter.ros2.conversions import ros_class, to_ros, to_time
from nav_adapter.ros2.node import AwarenessNode, _qos

PATIENCE_S = 20.0
READERS = {
    "odom": "on_odometry",
    "tf": "on_transforms",
    "tf_static": "on_transforms",
    "scan": "on_scan",
    "camera_info": "on_camera_info",
    "image": "on_image",
    "depth": "on_depth",
}
processed: Counter[str] = Counter()


def counted(name: str) -> Callable[..., Any]:
    """Return a method of the bridge that is counted when it has returned."""
    method = getattr(AwarenessBridge, name)

    def call(*arguments: Any, **options: Any) -> Any:
        result = method(*arguments, **options)
        processed[name] += 1
        return result

    return call


def main(recording: str, out: str, rate_hz: str) -> None:
    keys = {"/camera/depth": "depth", **{f"/{READ[key].name}": key for key in READERS}}
    with AnyReader([Path(recording)]) as reader:
        messages = [(keys[c.topic], ns, bytes(raw)) for c, ns, raw in reader.messages()]
    for name in {*READERS.values(), "tick"}:
        setattr(AwarenessBridge, name, counted(name))
    node, player = AwarenessNode(), rclpy.create_node("player")
    heard: list[tuple[str, str]] = []
    for key, topic in PUBLISHED.items():

        def hear(message: bytes, key: str = key) -> None:
            heard.append((key, bytes(message).hex()))

        kind = ros_class(topic.message)
        player.create_subscription(kind, topic.name, hear, _qos(topic), raw=True)
    clock = player.create_publisher(Clock, "/clock", 10)
    publishers = {
        key: player.create_publisher(ros_class(READ[key].message), READ[key].name, _qos(READ[key]))
        for key in {key for key, _, _ in messages}
    }
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executor.add_node(player)

    def until(condition: Callable[[], bool]) -> None:
        end = time.monotonic() + PATIENCE_S
        while not condition():
            executor.spin_once(timeout_sec=0.01)
            if time.monotonic() > end:
                sys.exit(f"nothing after {processed}")

    def set_clock(now_s: float) -> None:
        stamp = to_time(now_s)
        clock.publish(Clock(clock=to_ros(stamp)))
        now_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
        until(lambda: node.get_clock().now().nanoseconds == now_ns)

    def play(key: str, raw: bytes) -> None:
        name = READERS[key]
        before = processed[name]
        publishers[key].publish(to_ros(decode(READ[key].message, raw)))
        until(lambda: processed[name] > before)

    until(lambda: all(p.get_subscription_count() for p in node._publishers_by_key.values()))
    until(lambda: all(p.get_subscription_count() for p in (clock, *publishers.values())))
    for key, _, raw in messages:
        if key == "tf_static":
            play(key, raw)
    began_s, ticks = messages[0][1] / 1e9, 0
    for key, at_ns, raw in messages:
        while (tick_s := began_s + ticks / float(rate_hz)) <= at_ns / 1e9:
            set_clock(tick_s)
            until(lambda: processed["tick"] > ticks)  # noqa: B023 - called at once
            ticks += 1
        set_clock(at_ns / 1e9)
        # Every message but the calibration, of which the first one is enough.
        if key != "tf_static" and not (key == "camera_info" and processed["on_camera_info"]):
            play(key, raw)
    spoken = time.monotonic() + 1.0
    until(lambda: time.monotonic() > spoken)
    Path(out).write_text(json.dumps(heard), encoding="utf-8")
    # Neither ROS nor threads have anything left to do.
    os._exit(0)


if __name__ == "__main__":
    rclpy.init()
    main(*sys.argv[1:4])
