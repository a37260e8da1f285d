"""A genuine Nav2 drives crossings: set up ROS 2 and Nav2, source the environment, then run this."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from paths import ROOT

pytest.importorskip("pybullet", reason="the crossings need the extra sim")
pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from sim_tests import SimError, run_crossing
from sim_tests.crossing.planner.ros2 import python_with_ros
from sim_tests.study.measures import measure

try:
    ROS_PYTHON = python_with_ros()
except SimError:
    ROS_PYTHON = ""
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (ROS_PYTHON and Path(os.environ.get("OVERLAY", "-")).is_dir()),
        reason="needs rclpy and, at OVERLAY, a Nav2: source a ROS environment that has both",
    ),
]


@pytest.fixture
def nav2(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[subprocess.Popen[bytes]]:
    """Controller and planner server, which are activated when there is a robot."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(random.SystemRandom().randint(1, 200)))
    monkeypatch.chdir(ROOT)
    words = [ROS_PYTHON, "-m", "benchmarks.nav2.launch", "RPP", "--bare"]
    log = tmp_path / "nav2.log"
    log.touch()
    with subprocess.Popen([*words, "--log", str(log)], stdout=subprocess.PIPE) as process:
        yield process
        process.terminate()


def test_awareness_is_worth_seconds_under_nav2(nav2: subprocess.Popen[bytes]) -> None:
    """Somebody who watches the robot is passed within the limit; without awareness it waits."""
    results = {
        policy: run_crossing("crossing_attentive", policy=policy, planner="ros2")
        for policy in ("balanced", "blind")
    }
    times_s = {policy: each.time_to_goal_s for policy, each in results.items()}
    assert None not in times_s.values(), times_s
    assert times_s["balanced"] + 2.0 < times_s["blind"]
    for result in results.values():
        row = measure(result)
        assert row.late_share is not None
        assert not row.moving_touched
        # It obeys: no faster than the limit of half a second before, and what braking leaves.
        speeds = np.array([each.robot_state.speed_mps for each in result.frames])
        limits = np.array([each.constraints.speed_limit_mps for each in result.frames])
        highest = np.array([limits[max(i - 10, 0) : i + 1].max() for i in range(len(limits))])
        assert (speeds <= highest + 0.05).mean() > 0.97


def test_a_nav2_that_is_not_active_is_an_error_that_says_so(
    nav2: subprocess.Popen[bytes], tmp_path: Path
) -> None:
    end = time.monotonic() + 60.0
    while b"Created global planner plugin" not in (tmp_path / "nav2.log").read_bytes():
        assert time.monotonic() < end
        time.sleep(0.2)
    nav2.send_signal(signal.SIGSTOP)  # nobody activates what is configured
    try:
        with pytest.raises(SimError, match=r"has sent no cmd_vel in 15 s .* are its lifecycle"):
            run_crossing("crossing_attentive", policy="blind", planner="ros2(goal='follow_path')")
    finally:
        nav2.send_signal(signal.SIGCONT)
