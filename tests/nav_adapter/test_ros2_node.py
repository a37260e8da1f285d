"""The rclpy node without ROS, with a stand-in for rclpy, and the conversion of its messages."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import pytest
from bridge_scenes import INFO, PATIENCE_S, Network, image, odometry
from paths import ROOT
from ros2_scenes import everything, plain
from scan_scenes import scan_message

from nav_adapter import NavError
from nav_adapter.ros2 import MASK_TOPICS, PUBLISHED, READ, RobotFile, ScannerMount, node
from nav_adapter.ros2.conversions import from_ros, ros_class, to_ros
from nav_adapter.ros2.messages.nav2_msgs import CircleObject
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.node import AwarenessNode
from perception import PerceptionError
from tracking import TrackingError
from tracking.prediction import PredictionModel

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


class StandInNode:
    """The part of rclpy's Node that the node calls."""

    parameters: ClassVar[dict[str, Any]] = {}

    def __init__(self, name: str) -> None:
        self.sent: dict[str, list[Any]] = defaultdict(list)
        self.callbacks: dict[str, Callable[[Any], None]] = {}

    def declare_parameter(self, name: str, default: Any) -> Any:
        given = {"robot_file": str(ROOT / "docs" / "nav2" / "robot.yaml"), **self.parameters}
        return SimpleNamespace(value=given.get(name, default))

    def resolve_topic_name(self, name: str) -> str:
        return f"/robot_1/{name}"

    def get_logger(self) -> Any:
        return SimpleNamespace(warning=lambda text: None)

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=time.time_ns()))

    def create_publisher(self, kind: Any, name: str, qos: Any) -> Any:
        return SimpleNamespace(
            publish=self.sent[name].append,
            get_subscription_count=lambda: 1,
            topic_name=f"/robot_1/{name}",
        )

    def create_subscription(self, kind: Any, name: str, callback: Any, qos: Any) -> None:
        self.callbacks[name] = callback

    def create_timer(self, period_s: float, callback: Callable[[], None]) -> None:
        self.period_s, self.timer = period_s, callback


@pytest.fixture
def node_module(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The node's module, imported with the stand-in."""
    anything = SimpleNamespace(RELIABLE=1, BEST_EFFORT=2, TRANSIENT_LOCAL=1, VOLATILE=2)
    for name, content in {
        "rclpy": {},
        "rclpy.exceptions": {"InvalidParameterTypeException": TypeError},
        "rclpy.executors": {"SingleThreadedExecutor": anything},
        "rclpy.node": {"Node": StandInNode},
        "rclpy.qos": {
            "DurabilityPolicy": anything,
            "QoSProfile": lambda **settings: settings,
            "ReliabilityPolicy": anything,
        },
        "rclpy.signals": {"SignalHandlerOptions": anything},
    }.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    name = "nav_adapter.ros2.node_of_stand_in"
    spec = importlib.util.spec_from_file_location(name, node.__file__)
    assert spec is not None
    assert spec.loader is not None
    made: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    made.ros_class = lambda kind: SimpleNamespace
    made.to_ros = lambda message: to_ros(message, lambda kind: SimpleNamespace)
    return made


@pytest.fixture
def two_scanners(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parameters for two scanners without a camera."""
    path = tmp_path / "robot.yaml"
    mounts = [
        ScannerMount(position_base_m=[x, 0.0, 0.2], yaw_deg=yaw)
        for x, yaw in ((0.3, 0.0), (-0.3, 180.0))
    ]
    docs = RobotFile.from_yaml(ROOT / "docs" / "nav2" / "robot.yaml")
    docs.model_copy(update={"scanners": mounts}).to_yaml(path)
    given = {"robot_file": str(path), "scanners": 2, "use_camera": False}
    monkeypatch.setattr(StandInNode, "parameters", given)


def test_the_node_reads_scanners_and_a_map_and_publishes_the_speed_mask(
    node_module, two_scanners, monkeypatch
):
    for name, value in (("use_map", True), ("speed_mask_hz", 2.0)):
        monkeypatch.setitem(StandInNode.parameters, name, value)
    ros_node = node_module.AwarenessNode()
    assert set(ros_node.callbacks) == {"odom", "tf", "tf_static", "scan", "scan_2", "map"}

    def hear(key: str, message: Any) -> None:
        ros_node.callbacks[READ[key].name](to_ros(message, lambda kind: SimpleNamespace))

    try:
        limits = ros_node.sent[PUBLISHED["speed_limit"].name]
        ros_node.timer()
        end = time.monotonic() + PATIENCE_S
        while ros_node._bridge.counts["scans"] < 10 and time.monotonic() < end:
            now = time.time()
            hear("odom", odometry(now, speed=0.0))
            hear("scan", scan_message(now))
            hear("scan_2", scan_message(now))
            time.sleep(0.02)
        ros_node.timer()
        assert limits[-1].speed_limit > limits[0].speed_limit
        (info,) = ros_node.sent[MASK_TOPICS["speed_mask_info"].name]
        assert info.filter_mask_topic == "/robot_1/awarenav/speed_mask"  # as remapped
        assert len(ros_node.sent[MASK_TOPICS["speed_mask"].name]) == 1
    finally:
        ros_node.stop()
    assert limits[-1].speed_limit == limits[0].speed_limit


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ({"scanners": 3}, "scanners must be 0, 1 or 2, got 3"),
        ({"use_camera": False}, "scanners must name one or two"),
        ({}, "networks have seen renders only"),
    ],
)
def test_the_node_refuses_sensors_that_make_no_sense(node_module, monkeypatch, parameters, text):
    monkeypatch.setattr(StandInNode, "parameters", parameters)
    with pytest.raises((NavError, PerceptionError), match=text):
        node_module.AwarenessNode()


def test_the_node_takes_a_calibrated_prediction_or_refuses_the_file(
    node_module, two_scanners, monkeypatch, tmp_path
):
    path = tmp_path / "prediction.yaml"
    monkeypatch.setitem(StandInNode.parameters, "prediction_file", str(path))
    with pytest.raises(TrackingError, match=r"prediction\.yaml"):
        node_module.AwarenessNode()
    model = PredictionModel(horizons_s=(1.0,), std_factors=(1.2,))
    model.to_yaml(path)
    ros_node = node_module.AwarenessNode()
    try:
        assert ros_node._bridge._adapter._prediction == model
        assert MASK_TOPICS["speed_mask"].name not in ros_node.sent  # by default there is none
    finally:
        ros_node.stop()


def test_the_node_publishes_while_perception_is_busy(node_module: Any) -> None:
    network = Network()
    network.close()
    node_module._pipelines = lambda *files, allowed: lambda camera: network
    ros_node = node_module.AwarenessNode()

    def hear(key: str, message: Any) -> None:
        ros_node.callbacks[READ[key].name](to_ros(message, lambda kind: SimpleNamespace))

    assert ros_node.period_s == 0.05
    hear("camera_info", INFO)
    hear("odom", odometry(time.time()))
    try:
        end = time.monotonic() + PATIENCE_S
        while not network.entered.is_set() and time.monotonic() < end:
            # Images that come before the pipeline is made are refused.
            hear("odom", odometry(time.time()))
            hear("image", image(time.time()))
            network.entered.wait(0.01)
        assert network.entered.is_set()
        for _ in range(10):
            ros_node.timer()
        limits = ros_node.sent[PUBLISHED["speed_limit"].name]
        assert len(limits) == 10
        assert {name for name, sent in ros_node.sent.items() if sent} >= {
            PUBLISHED[key].name for key in PUBLISHED if key != "circles"
        }
        network.open.set()
        while not ros_node._bridge.counts["frames"] and time.monotonic() < end:
            time.sleep(0.01)
        hear("odom", odometry(time.time()))
        ros_node.timer()
        assert limits[-1].speed_limit > limits[0].speed_limit
    finally:
        network.open.set()
        ros_node.stop()
    assert limits[-1].speed_limit == limits[0].speed_limit
