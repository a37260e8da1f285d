"""The rclpy node without ROS, and the conversion of its messages."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from types import SimpleNamespace

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from ros2_scenes import ROOT, everything, plain, typestore

from nav_adapter import NavError
from nav_adapter.ros2.conversions import from_ros, ros_class, to_ros
from nav_adapter.ros2.messages.nav2_msgs import CircleObject
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.node import AwarenessNode

STORE = typestore()
MESSAGES = [*everything(), ("odom", Odometry())]
no_ros = pytest.mark.skipif(
    importlib.util.find_spec("rclpy") is not None, reason="ROS is installed here"
)


@pytest.mark.parametrize(("key", "message"), MESSAGES, ids=lambda value: str(value)[:12])
def test_a_message_is_the_same_after_both_conversions(key: str, message) -> None:
    ros_message = to_ros(message, lambda kind: SimpleNamespace)
    assert from_ros(type(message), ros_message) == message


def test_ros_messages_have_the_sequence_types_of_rclpy() -> None:
    messages = dict(everything())
    grid = to_ros(messages["grid"], lambda kind: SimpleNamespace)
    assert grid.data.typecode == "b"
    assert list(grid.data.tobytes()) == plain(messages["grid"])["data"]
    circle = to_ros(messages["circles"], lambda kind: SimpleNamespace)
    assert circle.uuid.uuid == list(messages["circles"].uuid.uuid)
    # rclpy takes an octet as bytes of length one.
    levels = [
        each.level for each in to_ros(messages["alerts"], lambda kind: SimpleNamespace).status
    ]
    assert levels == [b"\x00", b"\x01"]
    assert isinstance(to_ros(messages["people"], lambda kind: SimpleNamespace).people, list)


@no_ros
def test_without_ros_the_node_says_what_is_missing() -> None:
    with pytest.raises(NavError, match="needs rclpy"):
        AwarenessNode()
    with pytest.raises(ImportError):
        ros_class(CircleObject)


@no_ros
def test_without_ros_the_program_prints_one_line() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "nav_adapter.ros2.node"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("awarenav node: the node needs rclpy")
    assert "Traceback" not in done.stderr
