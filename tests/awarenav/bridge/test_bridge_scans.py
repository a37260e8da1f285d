"""``awarenav bridge`` with laser scanners, over DDS."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from paths import ROOT

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
pytest.importorskip("mcap", reason="the extra ros2 is not installed")

from rendered_image import odometry
from rosbags.highlevel import AnyReader
from scan_scenes import scan_message

from nav_adapter.ros2 import PUBLISHED, READ, DdsNode, RobotFile, ScannerMount, renamed

ROBOT = ROOT / "docs" / "nav2" / "robot.yaml"
PATIENCE_S = 60.0
PERSON = (2.5, 1.2)
MOUNTS = [
    ScannerMount(position_base_m=[0.36, 0.25, 0.2], yaw_deg=45.0),
    ScannerMount(position_base_m=[-0.36, -0.25, 0.2], yaw_deg=-135.0),
]
TOPICS = [renamed(READ["scan"], "scan_front"), renamed(READ["scan"], "/scan_rear")]
SCANS = ["--scan", "scan_front", "--scan", "/scan_rear"]


@pytest.fixture
def robot_file(tmp_path: Path) -> Path:
    """The robot of the docs, with two diagonal scanners."""
    path = tmp_path / "robot.yaml"
    RobotFile.from_yaml(ROBOT).model_copy(update={"scanners": MOUNTS}).to_yaml(path)
    return path


@pytest.mark.slow
def test_scans_on_dds_give_a_person_and_a_speed_limit(
    domain: int, robot_file: Path, tmp_path: Path
) -> None:
    recording = tmp_path / "run.mcap"
    robot = DdsNode(domain)
    for topic in TOPICS:
        robot.advertise(topic)
    robot.advertise(replace(READ["odom"], reliable=True))
    for topic in PUBLISHED.values():
        robot.subscribe(topic)
    command = [sys.executable, "-m", "awarenav", "bridge", "--domain", str(domain)]
    command += ["--robot", str(robot_file), "--no-camera", *SCANS, "--record", str(recording)]
    heard: dict = defaultdict(list)

    def found() -> bool:
        people = heard["people"][-1].people if heard["people"] else ()
        # On a busy computer the limit is still rising from the stop of the start.
        limits = [each.speed_limit for each in heard["speed_limit"]]
        return any(each.reliability == 1.0 for each in people) and limits[-1:] > [0.1]

    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as bridge:
        try:
            end = time.monotonic() + PATIENCE_S
            while not found() and time.monotonic() < end:
                now = time.time()
                robot.publish(READ["odom"], odometry(now))
                for topic, mount in zip(TOPICS, MOUNTS, strict=True):
                    robot.publish(topic, scan_message(now, [PERSON], mount.T_base_scanner()))
                time.sleep(0.04)
                for key, topic in PUBLISHED.items():
                    heard[key] += robot.take(topic)
            bridge.send_signal(signal.SIGINT)
            _, said = bridge.communicate(timeout=PATIENCE_S)
        finally:
            bridge.kill()
            robot.close()
    (person,) = heard["people"][-1].people
    assert np.hypot(person.position.x - PERSON[0], person.position.y - PERSON[1]) < 0.15
    assert dict(zip(person.tagnames, person.tags, strict=True))["awareness_lower"] == "0.000"
    limits = [each.speed_limit for each in heard["speed_limit"]]
    assert 0.1 < limits[-1] < 1.4
    sensors = heard["alerts"][-1].status[1]
    assert sensors.message == "all sensors are at work"
    assert bridge.returncode == 0, said
    assert "Traceback" not in said
    assert "reading /scan_front and /scan_rear and /odom" in said
    with AnyReader([recording]) as reader:
        recorded = {each.topic for each in reader.connections}
    assert {"/odom", "/scan_front", "/scan_rear"} <= recorded
