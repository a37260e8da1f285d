"""The bridge and the node as processes, with a robot of rclpy."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
from conftest import PATIENCE_S, qos, until
from scan_scenes import scan_message
from troubled_publishers import HEARD, live_through, one_scanner

from nav_adapter.ros2 import PUBLISHED, READ, SLOWEST_MPS, Topic, renamed
from nav_adapter.ros2.conversions import from_ros, ros_class, to_ros, to_time
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.std_msgs import Header

NODE = "nav_adapter.ros2.node"
START_S, STEP_S = 1000.0, 0.05


class RosPeer:
    """A peer with rclpy."""

    def __init__(self, node: Any, prefix: str = "") -> None:
        self._node = node
        self._publishers: dict[str, Any] = {}
        self._heard: dict[str, list[Message]] = defaultdict(list)
        for key in HEARD:
            kind = PUBLISHED[key].message

            def hear(message: Any, key: str = key, kind: type[Message] = kind) -> None:
                self._heard[key].append(from_ros(kind, message))

            name = f"{prefix}{PUBLISHED[key].name}"
            node.create_subscription(ros_class(kind), name, hear, qos(PUBLISHED[key]))

    def send(self, name: str, topic: Topic, message: Message) -> None:
        if name not in self._publishers:
            self._publishers[name] = self._node.create_publisher(
                ros_class(topic.message), topic.name, qos(topic)
            )
        self._publishers[name].publish(to_ros(message))

    def leave(self, name: str) -> None:
        self._node.destroy_publisher(self._publishers.pop(name))

    def hear(self, key: str) -> list[Message]:
        import rclpy  # noqa: PLC0415 - skipped without it

        for _ in range(4):
            rclpy.spin_once(self._node, timeout_sec=0.0)
        return self._heard.pop(key, [])


def test_the_bridge_lives_while_publishers_of_ros_come_and_go(peer: Any, tmp_path: Path) -> None:
    live_through(
        RosPeer(peer), int(os.environ["ROS_DOMAIN_ID"]), one_scanner(tmp_path / "robot.yaml")
    )


def drive_on_simulated_time(peer: Any, robot: RosPeer, node: Any) -> None:
    """Send clock, odometry and scans, stamped long ago, until the node releases the robot."""
    from rosgraph_msgs.msg import Clock  # noqa: PLC0415 - part of rclpy's wheels

    clock = peer.create_publisher(Clock, "/clock", 10)
    now_s = START_S

    def drives() -> bool:
        nonlocal now_s
        now_s += STEP_S
        assert node.poll() is None, node.communicate()[1]
        clock.publish(Clock(clock=to_ros(to_time(now_s))))
        odom = renamed(READ["odom"], "robot_1/odom")
        robot.send("odom", odom, Odometry(Header(to_time(now_s), "odom"), "base_link"))
        robot.send("scan", renamed(READ["scan"], "front/scan"), scan_message(now_s))
        time.sleep(0.02)
        limits = robot.hear("speed_limit")
        stamps_s = [each.header.stamp.sec for each in limits]
        assert all(START_S <= stamp_s <= now_s + 1e-6 for stamp_s in stamps_s), stamps_s
        return any(each.speed_limit > SLOWEST_MPS for each in limits)

    assert until(drives)


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_the_node_drives_on_simulated_time_and_ends_with_a_stop(
    peer: Any, tmp_path: Path, end: signal.Signals
) -> None:
    arguments = ["--ros-args", "-p", f"robot_file:={one_scanner(tmp_path / 'robot.yaml')}"]
    arguments += ["-p", "use_camera:=false", "-p", "scanners:=1", "-p", "use_sim_time:=true"]
    arguments += ["-p", "rate_hz:=10.0", "-r", "__ns:=/robot_1", "-r", "scan:=/front/scan"]
    robot = RosPeer(peer, "robot_1/")
    command = [sys.executable, "-m", NODE, *arguments]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as node:
        try:
            drive_on_simulated_time(peer, robot, node)
            node.send_signal(end)
            _, said = node.communicate(timeout=PATIENCE_S)
        finally:
            node.kill()
    assert node.returncode == 0, said
    assert "Traceback" not in said
    last: list[Any] = []
    assert until(lambda: last.extend(robot.hear("speed_limit")) or last)
    assert last[-1].speed_limit == SLOWEST_MPS
    # Its last word says why.
    reasons = [message.status[0].message for message in robot.hear("alerts")]
    assert reasons[-1] == "the awarenav node has ended"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ([], "robot_file must name"),
        (["-p", "robot_file:=missing.yaml"], "missing.yaml"),
        (["-p", "rate_hz:=fast"], "rate_hz"),
    ],
)
def test_a_wrong_parameter_is_refused_in_one_line(
    peer: Any, tmp_path: Path, arguments: list[str], text: str
) -> None:
    if text == "rate_hz":
        robot = str(one_scanner(tmp_path / "robot.yaml"))
        arguments += ["-p", f"robot_file:={robot}", "-p", "use_camera:=false", "-p", "scanners:=1"]
    done = subprocess.run(
        [sys.executable, "-m", NODE, "--ros-args", *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    assert done.returncode == 2
    assert text in done.stderr
    assert "Traceback" not in done.stderr
