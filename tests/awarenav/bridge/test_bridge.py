from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from paths import ROOT

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
pytest.importorskip("mcap", reason="the extra ros2 is not installed")

from rendered_image import RenderedImage, odometry
from rosbags.highlevel import AnyReader

from awarenav.bridge._loop import BridgeInputs, BridgeLoop, TopicPublisher
from awarenav.cli import main
from nav_adapter import AwarenessPolicy
from nav_adapter.ros2 import (
    PUBLISHED,
    READ,
    SLOWEST_MPS,
    AwarenessBridge,
    DdsNode,
    McapRecorder,
    RobotFile,
)
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo
from perception import AwarenessPipeline, Camera

ROBOT = ROOT / "docs" / "nav2" / "robot.yaml"
PATIENCE_S = 60.0
SCANS = ["--scan", "a", "--scan", "b"]


class Nobody:
    """Networks that find nobody."""

    def detect(self, image_rgb):
        return ()

    def estimate(self, image_rgb, *_):
        return ()


@pytest.fixture(scope="module")
def robot_without_mount(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("robot") / "robot.yaml"
    RobotFile.from_yaml(ROBOT).model_copy(update={"camera": None}).to_yaml(path)
    return path


@pytest.fixture
def robot(domain: int) -> Iterator[DdsNode]:
    """The robot's side: sends a camera and odometry, hears what Nav2 hears."""
    node = DdsNode(domain)
    for key in ("image", "compressed"):  # as camera drivers send them
        node.advertise(READ[key])
    for key in ("camera_info", "odom", "tf_static"):
        node.advertise(replace(READ[key], reliable=True))
    for topic in PUBLISHED.values():
        node.subscribe(topic)
    yield node
    node.close()


def command(domain: int, *arguments: str) -> list[str]:
    program = [sys.executable, "-m", "awarenav", "bridge", "--allow-simulator-networks"]
    return [*program, "--domain", str(domain), *arguments]


def drive(
    robot: DdsNode, scene: RenderedImage, heard: dict, done, *, compressed: bool = False
) -> bool:
    """Send frames until ``done``, with what Nav2 hears in ``heard``."""
    robot.publish(READ["tf_static"], scene.mounted())
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        now = time.time()
        robot.publish(READ["odom"], odometry(now))
        robot.publish(READ["camera_info"], scene.info(now))
        if compressed:
            robot.publish(READ["compressed"], scene.compressed(now))
        else:
            robot.publish(READ["image"], scene.image(now))
        time.sleep(0.04)
        for key, topic in PUBLISHED.items():
            heard[key] += robot.take(topic)
        if done(heard):
            return True
    return False


@pytest.mark.slow
@pytest.mark.parametrize(
    "compressed",
    [False, pytest.param(True, marks=pytest.mark.full)],
    ids=["raw", "compressed"],
)
def test_an_image_on_dds_gives_a_person_and_a_speed_limit(
    robot: DdsNode,
    domain: int,
    scene: RenderedImage,
    robot_without_mount: Path,
    tmp_path: Path,
    compressed: bool,
) -> None:
    recording = tmp_path / "run.mcap"
    arguments = ["--robot", str(robot_without_mount), "--record", str(recording)]
    if compressed:
        arguments += ["--compressed", "--image", "/camera/image_raw/compressed"]
    heard: dict = defaultdict(list)

    def confirmed(heard: dict) -> bool:
        people = heard["people"][-1].people if heard["people"] else ()
        return any(each.reliability == 1.0 for each in people)

    with subprocess.Popen(command(domain, *arguments), stderr=subprocess.PIPE, text=True) as bridge:
        try:
            assert drive(robot, scene, heard, confirmed, compressed=compressed)
            bridge.send_signal(signal.SIGINT)
            _, said = bridge.communicate(timeout=PATIENCE_S)
        finally:
            bridge.kill()
    # Before anything was known it stood still; then the person limits it; last it stands again.
    assert heard["speed_limit"][0].speed_limit == SLOWEST_MPS
    (person,) = heard["people"][-1].people
    assert np.hypot(*(np.array([person.position.x, person.position.y]) - scene.place_m)) < 0.35
    assert SLOWEST_MPS < heard["speed_limit"][-1].speed_limit < 1.5
    (found,) = heard["detections"][-1].detections
    assert found.id == person.name
    assert bridge.returncode == 0, said
    assert "Traceback" not in said
    assert "a stop was published" in said
    with AnyReader([recording]) as reader:
        last = {
            connection.topic: reader.deserialize(raw, connection.msgtype)
            for connection, _, raw in reader.messages()
        }
    assert last["/speed_limit"].speed_limit == SLOWEST_MPS
    assert {"/odom", "/tf_static", *(f"/{t.name}" for t in PUBLISHED.values())} == set(last)


def test_only_messages_with_a_subscriber_or_a_recorder_are_wanted(
    domain: int, tmp_path: Path
) -> None:
    node, other = DdsNode(domain), DdsNode(domain)
    try:
        publisher = TopicPublisher(node, PUBLISHED, None)
        # A latched topic must keep its last message for later subscribers.
        assert {key for key in PUBLISHED if publisher.wants(key)} == {"grid"}
        assert not publisher.wants("left out")
        other.subscribe(PUBLISHED["people"])
        end = time.monotonic() + PATIENCE_S
        while not publisher.wants("people") and time.monotonic() < end:
            time.sleep(0.01)
        assert {key for key in PUBLISHED if publisher.wants(key)} == {"grid", "people"}
        with McapRecorder(tmp_path / "all.mcap") as recorder:
            recorded = TopicPublisher(node, PUBLISHED, recorder)
            assert all(recorded.wants(key) for key in PUBLISHED)
    finally:
        other.close()
        node.close()


def test_sigterm_ends_the_bridge_with_a_stop(domain: int) -> None:
    with subprocess.Popen(
        command(domain, "--robot", str(ROBOT)), stderr=subprocess.PIPE, text=True
    ) as bridge:
        try:
            assert bridge.stderr is not None
            while "reading" not in bridge.stderr.readline():
                assert bridge.poll() is None
            time.sleep(0.2)
            bridge.terminate()
            _, said = bridge.communicate(timeout=PATIENCE_S)
        finally:
            bridge.kill()
    assert bridge.returncode == 0, said
    assert "ended after 0 frames" in said


def test_the_loop_waits_while_messages_come_that_it_does_not_need(domain: int) -> None:
    node, other = DdsNode(domain), DdsNode(domain)
    scene_camera = Camera(64, 48, 50.0, 50.0, 32.0, 24.0)
    waits: list[float] = []
    wait = node.wait

    def counted(timeout_s: float) -> bool:
        waits.append(timeout_s)
        return wait(timeout_s)

    node.wait = counted  # type: ignore[method-assign]
    bridge = AwarenessBridge(
        AwarenessPolicy.preset("balanced"),
        RobotFile.from_yaml(ROBOT).profile(),
        lambda key, message: None,
        camera=scene_camera,
        make_pipeline=lambda camera: AwarenessPipeline(camera, Nobody(), Nobody(), Nobody()),
    )
    loop = BridgeLoop(
        node, bridge, BridgeInputs(READ["image"], READ["odom"], READ["camera_info"]), 20.0
    )
    try:
        other.advertise(READ["camera_info"])
        end = time.monotonic() + PATIENCE_S
        while not other.readers_of(READ["camera_info"]) and time.monotonic() < end:
            time.sleep(0.01)
        other.publish(READ["camera_info"], CameraInfo())
        loop.run(0.3)
        # At most one for each publication and one for the message, and not thousands.
        assert 3 <= len(waits) <= 12
    finally:
        assert loop.close()
        other.close()
        node.close()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--robot", "nowhere.yaml"], "cannot read nowhere.yaml"),
        ([], "ROS_DOMAIN_ID must be a number from 0 to 232, got 'zero'"),
        (["--policy", "bold"], "did you mean 'blind'? It must be one of"),
        (["--rate", "0"], "--rate"),
        (["--detector", "nowhere"], "--detector must be"),
        (["--seconds", "-1"], "--seconds"),
        (["--domain", "300"], "0<=x<=232"),
        (["--topic", "speed=x"], "--topic must be KEY=TOPIC"),
        (["--topic", "people=speed_limit"], "share a topic"),
        (["--only", "speed"], "--only must name some of"),
        (["--only", "speed_mask"], "--only speed_mask needs --speed-mask"),
        (
            ["--speed-mask", "2", "--only", "people"],
            "--speed-mask needs --only speed_mask too",
        ),
        (["--speed-mask", "0"], "the speed mask's rate_hz"),
        (["--image", "a b"], "a topic must consist of"),
        (["--record", "nowhere/run.mcap"], "cannot write nowhere"),
        (["--camera", "nowhere.yaml"], "cannot read nowhere.yaml"),
        (["--bag", str(ROBOT)], "cannot read the recording"),
        (["--prediction", "nowhere.yaml"], "nowhere.yaml"),
        (["--prediction", str(ROBOT)], "unknown key"),
        (["--no-camera"], "--no-camera needs a scanner"),
        (["--map", "map"], "--map is for the scans"),
        ([*SCANS, "--scan", "c"], "--scan must name up to 2"),
        (["--scan", "a", "--scan", "/a"], "different topics, got a, a"),
        (["--scan", "a b"], "a topic must consist of"),
        (["--scan", "a"], "as many scanners as there are scan topics, 1"),
        (
            [*SCANS, "--no-camera", "--camera", "camera.yaml"],
            "--no-camera and --camera exclude each other",
        ),
        (
            [*SCANS, "--no-camera", "--depth", "depth"],
            "--no-camera and --depth exclude each other",
        ),
    ],
)
def test_bad_input_is_refused_in_a_line(
    arguments: list[str], text: str, domain: int, monkeypatch, capsys
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "zero")
    given = [] if "zero" in text else ["--domain", str(domain)]
    if "--robot" not in arguments:
        given += ["--robot", str(ROBOT)]
    assert main(["bridge", *given, "--allow-simulator-networks", *arguments]) == 2
    said = capsys.readouterr().err
    assert text in said
    assert said.splitlines()[-1].startswith("awarenav bridge: ")


def test_a_robot_file_with_a_wrong_scanner_is_refused(tmp_path: Path, capsys) -> None:
    path = tmp_path / "robot.yaml"
    for key, value in {"field_of_view_deg": [90, -90], "yaw_deg": 200, "height_m": 0.2}.items():
        scanner = f"scanners:\n  - position_base_m: [0.3, 0.0, 0.2]\n    {key}: {value}\n"
        path.write_text(ROBOT.read_text().split("scanners:")[0] + scanner)
        assert main(["bridge", "--robot", str(path), "--scan", "scan"]) == 2
        assert key in capsys.readouterr().err


def test_the_bridge_ends_after_its_seconds_without_a_robot(
    domain: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = tmp_path / "quiet.mcap"
    arguments = ["--robot", str(ROBOT), "--domain", str(domain), "--seconds", "0.3"]
    arguments.append("--allow-simulator-networks")
    only = ["--only", "speed_limit", "--topic", "speed_limit=/robot_1/limit"]
    assert main(["bridge", *arguments, *only, "--record", str(recording)]) == 0
    assert "/robot_1/limit" in capsys.readouterr().err
    with AnyReader([recording]) as reader:
        limits = {
            (connection.topic, reader.deserialize(raw, connection.msgtype).speed_limit)
            for connection, _, raw in reader.messages()
        }
    assert limits == {("/robot_1/limit", SLOWEST_MPS)}
