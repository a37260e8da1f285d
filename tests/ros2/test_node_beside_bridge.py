from __future__ import annotations

import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
from conftest import PATIENCE_S
from recorded_messages import recorded
from robot_recording import messages
from rosbags.highlevel import AnyReader
from troubled_publishers import one_scanner

from awarenav.cli import main
from nav_adapter.ros2 import PUBLISHED, decode

PLAYER = Path(__file__).with_name("node_in_lockstep.py")
RATE_HZ = 20.0
CAMERA = {
    "scanner": (["--no-camera"], ["-p", "use_camera:=false"]),
    "camera, depth and scanner": (
        ["--depth", "camera/depth", "--allow-simulator-networks"],
        ["-p", "depth:=true", "-p", "allow_simulator_networks:=true"],
    ),
}


def by_topic(found: list[tuple[str, bytes]]) -> dict[str, list[Any]]:
    """Return the messages of each topic in their order."""
    topics: dict[str, list[Any]] = defaultdict(list)
    for key, raw in found:
        topics[key].append(decode(PUBLISHED[key].message, raw))
    return topics


@pytest.mark.parametrize(
    "sensors", ["camera, depth and scanner", pytest.param("scanner", marks=pytest.mark.full)]
)
def test_node_and_bridge_say_the_same_to_the_last_digit(
    tmp_path: Path, peer: Any, sensors: str
) -> None:
    with_camera = sensors != "scanner"
    sent = messages(ticks=30, camera=with_camera, depth=with_camera)
    bag = recorded(tmp_path / "bag", sent)
    robot = one_scanner(tmp_path / "robot.yaml")
    of_bridge, of_node = CAMERA[sensors]
    arguments = ["--robot", str(robot), "--scan", "scan", "--rate", str(RATE_HZ), *of_bridge]
    out = tmp_path / "bridge.mcap"
    assert main(["bridge", "--bag", str(bag), "--record", str(out), *arguments]) == 0
    keys = {f"/{topic.name}": key for key, topic in PUBLISHED.items()}
    with AnyReader([out]) as reader:
        expected = by_topic([(keys[c.topic], bytes(raw)) for c, _, raw in reader.messages()])

    heard = tmp_path / "node.json"
    parameters = ["-p", f"robot_file:={robot}", "-p", "scanners:=1", "-p", f"rate_hz:={RATE_HZ}"]
    command = [sys.executable, str(PLAYER), str(bag), str(heard), str(RATE_HZ), "--ros-args"]
    done = subprocess.run(
        [*command, *parameters, "-p", "use_sim_time:=true", *of_node],
        capture_output=True,
        text=True,
        check=False,
        timeout=2 * PATIENCE_S,
    )
    assert done.returncode == 0, done.stderr
    found = by_topic([(key, bytes.fromhex(raw)) for key, raw in json.loads(heard.read_text())])
    assert found.keys() == expected.keys() == PUBLISHED.keys()
    for key in PUBLISHED:
        assert found[key] == expected[key], key
