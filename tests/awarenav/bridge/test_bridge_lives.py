from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from troubled_publishers import PATIENCE_S, OwnPeer, live_through, one_scanner, running


@pytest.mark.slow
def test_the_bridge_lives_while_publishers_come_and_go(domain: int, tmp_path: Path) -> None:
    peer = OwnPeer(domain)
    try:
        live_through(peer, domain, one_scanner(tmp_path / "robot.yaml"))
    finally:
        peer.close()


@pytest.mark.slow
def test_the_robot_of_the_examples_drives_as_the_bridge_allows(domain: int) -> None:
    robot = ROOT / "docs" / "nav2" / "robot.yaml"
    scans = ("--no-camera", "--scan", "scan_front", "--scan", "scan_rear")
    with running("awarenav", "bridge", "--robot", str(robot), "--domain", str(domain), *scans):
        done = subprocess.run(
            [sys.executable, str(ROOT / "examples" / "ros2_robot.py"), "8", str(domain)],
            capture_output=True,
            text=True,
            check=True,
            timeout=PATIENCE_S,
        )
    driven = [
        [float(number) for number in found]
        for found in re.findall(r"([0-9.]+) m/s  limit ([0-9.]+) m/s", done.stdout)
    ]
    speeds, limits = zip(*driven, strict=True)
    assert speeds[0] == limits[0] == 0.0  # it waits for the bridge
    assert max(speeds) > 0.3
    assert all(speed <= limit + 0.1 for speed, limit in driven)
