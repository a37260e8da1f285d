"""``awarenav watch`` in a process of its own, on a machine without a display."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from paths import ROOT
from run_scenes import SHORT

from awarenav.cli import main
from sim_tests.actors.robot import RobotModel
from sim_tests.conditions import Experiment
from sim_tests.study._commands import _job
from sim_tests.study.runs import plan_jobs, scenario_of

#: Three seconds of a robot on its way, with control at 20 Hz.
WATCHED = (
    SHORT.format(name="watched")
    .replace("control_hz: 10.0", "control_hz: 20.0")
    .replace("duration_s: 2.0", "duration_s: 3.0")
    .replace("goal_x_m: 0.6", "goal_x_m: 2.0")
)


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    path = tmp_path_factory.mktemp("scenario") / "watched.yaml"
    path.write_text(WATCHED)
    return str(path)


@contextmanager
def watching(*arguments: str) -> Iterator[tuple[subprocess.Popen, str]]:
    """Start the command; yield its process and the address that it prints."""
    hidden = ("DISPLAY", "WAYLAND_DISPLAY")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    process = subprocess.Popen(
        [sys.executable, "-m", "awarenav", "watch", *arguments],
        env={**environment, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline() + process.stdout.readline())
        assert found, process.stderr and process.stderr.read()
        yield process, found[0]
    finally:
        process.kill()
        process.communicate()


def test_another_process_sees_ten_states_a_second_to_the_end(scenario, tmp_path):
    page = tmp_path / "watched.html"
    with watching(scenario, "--perception", "truth", "--out", str(page)) as (process, url):
        with urllib.request.urlopen(url, timeout=20) as answer:
            assert b"<canvas" in answer.read()
        arrived, kinds, kind = [], [], "message"
        with urllib.request.urlopen(url + "states", timeout=20) as stream:
            for line in map(bytes.decode, stream):
                if line.startswith("event: "):
                    kind = line[7:].strip()
                elif line.startswith("data: "):
                    kinds.append(kind)
                    if kind == "message":
                        arrived.append((time.monotonic(), json.loads(line[6:])))
                    kind = "message"
        output, _ = process.communicate(timeout=20)
        assert process.returncode == 0
    assert (kinds[0], kinds[-1]) == ("begin", "end")
    assert set(kinds[1:-1]) == {"message"}
    seconds = arrived[-1][0] - arrived[0][0]
    assert (len(arrived) - 1) / seconds >= 10.0
    # The pace is that of the clock, not that of the processor.
    assert seconds == pytest.approx(arrived[-1][1]["t_s"], abs=1.5)
    assert "Goal not reached, least separation" in output
    assert "Nobody" not in output
    assert page.read_text().count('"t_s"') == len(arrived)


def test_a_crossing_that_nobody_watches_ends_too(scenario, capsys):
    arguments = ["--perception", "truth", "--wait", "0", "--speed", "20", "--no-camera"]
    assert main(["watch", scenario, *arguments, "--no-browser"]) == 0
    text = capsys.readouterr().out
    assert "Nobody has opened the page yet; the crossing starts." in text
    assert text.endswith("Nobody opened the page.\n")


def test_an_interrupted_crossing_ends_with_130(scenario):
    with watching(scenario, "--perception", "truth", "--wait", "60") as (process, _):
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=30)
        assert process.returncode == 130
        assert "interrupted" in error
        assert "Traceback" not in error


def test_a_crossing_is_watched_with_another_robot_and_population() -> None:
    values = {"scenario": "late_glance", "policy": "blind", "perception": "truth", "seed": 3}
    usual = Experiment.taken_from(dict(values))
    others = Experiment.taken_from({**values, "robot": "omni", "population": "recorded"})
    job = _job(others)
    assert (job.robot, job.population, job.camera) == ("omni", "recorded", "")
    scenario = scenario_of(job.scenario_text).draw(3)
    assert scenario.robot_model == RobotModel.shipped("omni")
    assert scenario.population == "recorded"
    (own,) = plan_jobs(["late_glance"], ["blind"], [3], perception="truth")
    assert _job(usual) == own
