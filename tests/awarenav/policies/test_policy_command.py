"""``awarenav policy show`` as a newcomer runs it."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from paths import ROOT

from awarenav.cli import main
from nav_adapter import AwarenessPolicy, NavAdapter, RobotProfile, RobotState
from nav_adapter.ros2 import RobotFile
from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack

OWN = """
inflation: {unaware_radius_m: 1.4, aware_radius_m: 0.5}
speed: {unaware_below: 0.2, aware_above: 0.7, aware_human_speed_mps: 0.4}
reach: {turn_deg: 40.0}
margins: {clearance_m: 0.2}
"""
ROBOT_FILE = """
footprint_m: [[0.6, 0.4], [-0.6, 0.4], [-0.6, -0.4], [0.6, -0.4]]
max_speed_mps: 1.2
max_acceleration_mps2: 0.8
max_deceleration_mps2: 0.8
reaction_time_s: 0.5
"""


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(OWN, encoding="utf-8")
    return path


def test_a_drawing_is_a_whole_file_and_the_same_every_time(tmp_path):
    first, second = tmp_path / "a.svg", tmp_path / "new" / "b.svg"
    for path in (first, second):
        assert main(["policy", "show", "blind", "--out", str(path)]) == 0
    assert first.read_bytes().startswith(b"<?xml")
    assert first.read_bytes() == second.read_bytes()
    assert not list(tmp_path.rglob("*.part"))


def limit_and_radius(policy, robot, alpha, ahead_m, beside_m):
    """Return what a new adapter gives once it has seen the person for 3.2 s."""
    adapter = NavAdapter(policy, robot)
    place = [robot.footprint_m[:, 0].max() + BODY_RADIUS_M + ahead_m, beside_m]
    for step in range(17):
        now = 0.2 * step
        track = PersonTrack(
            1, now, "confirmed", place, [0.0, 0.0], np.zeros((4, 4)), alpha, 0.0, alpha, 1.75, 0.0
        )
        result = adapter.update((track,), RobotState(now, [0.0, 0.0], 0.0, 0.5, 0.0), now)
    return result.speed_limit_mps, result.obstacles[0].radius_m


@pytest.mark.parametrize("with_file", [False, True])
def test_the_table_is_what_the_adapter_gives(own, tmp_path, with_file, capsys):
    """Ahead and 1.2 m beside, for the robot of the page and for one from a file."""
    robot = RobotProfile(
        [[0.35, 0.25], [-0.35, 0.25], [-0.35, -0.25], [0.35, -0.25]], 1.5, 1.0, 1.0, 0.3
    )
    more = []
    if with_file:
        path = tmp_path / "robot.yaml"
        path.write_text(ROBOT_FILE, encoding="utf-8")
        robot, more = RobotFile.from_yaml(path).profile(), ["--robot", str(path)]
    assert main(["policy", "show", str(own), "--out", "none", "--json", *more]) == 0
    (table,) = json.loads(capsys.readouterr().out).values()
    assert main(["policy", "show", str(own), "--out", "none", *more]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == str(own)
    rows = [line.split() for line in lines[3:-1]]
    policy = AwarenessPolicy.from_yaml(own)
    beside_m = table["beside_m"]
    assert beside_m == 1.2
    for row, alpha in enumerate(table["awareness"]):
        shown = [float(text) for text in rows[row] if text[0].isdigit()]
        assert shown[0] == alpha
        assert table["human_speed_mps"][row] == policy.speed.human_speed_mps(alpha)
        both = table["limit_ahead_mps"][row], table["limit_beside_mps"][row]
        assert shown[3:] == pytest.approx(both[0] + both[1], abs=0.0051)
        if alpha not in (0.0, 0.4, 1.0):
            continue
        for at_m, limits in zip((0.0, beside_m), both, strict=True):
            for ahead_m, limit_mps in zip(table["distance_m"], limits, strict=True):
                expected, radius_m = limit_and_radius(policy, robot, alpha, ahead_m, at_m)
                assert limit_mps == pytest.approx(expected, abs=1e-6)
        assert table["radius_m"][row] == pytest.approx(radius_m)
        assert shown[1] == pytest.approx(radius_m, abs=0.0051)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["balancd"], "did you mean 'balanced'"),
        (["nowhere.yaml"], "cannot read nowhere.yaml"),
        (["balanced", "--out", "drawing.gif"], "--out must end in .png, .svg, .pdf or be none"),
        (["balanced", "--robot", "nowhere.yaml"], "cannot read nowhere.yaml"),
    ],
)
def test_bad_input_is_refused_in_one_line(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["policy", "show", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("awarenav policy show: ")
    assert message in error
    assert list(tmp_path.iterdir()) == []


BLOCKED = """
import sys
for name in {blocked!r}:
    sys.modules[name] = None
from awarenav.cli import main
sys.exit(main(["policy", "show", "balanced", "--out", {out!r}]))
"""


@pytest.mark.parametrize(
    ("blocked", "out"),
    [(["pybullet", "av", "matplotlib"], "none"), (["pybullet", "av"], "a.png")],
)
def test_no_simulator_is_needed(blocked, out, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", BLOCKED.format(blocked=blocked, out=out)],
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.png").exists() is (out != "none")
