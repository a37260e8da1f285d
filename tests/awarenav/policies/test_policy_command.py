"""``awarenav policy show`` as a newcomer runs it."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from paths import ROOT

from awarenav.cli import main
from nav_adapter import AwarenessPolicy, NavAdapter, RobotProfile, RobotState
from nav_adapter.settled import settled_radius_m, settled_speed_limit_mps
from perception.anthropometry import BODY_RADIUS_M
from perception.installation import install_command
from tracking import PersonTrack

HEADS = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
OWN = """
inflation: {table_m: [[0.0, 1.2], [0.5, 0.6], [1.0, 0.5]]}
speed: {shape: two_level, unaware_below: 0.2, aware_above: 0.7}
rules:
  zones: {stop_within_m: 0.5, full_speed_beyond_m: 4.0}
  near_cap: {within_m: 2.0, speed_mps: 0.6}
"""


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(OWN, encoding="utf-8")
    return path


def test_help_says_what_it_does(capsys):
    assert main(["policy", "show", "--help"]) == 0
    text = capsys.readouterr().out
    for option in ("--out", "--max-speed", "--deceleration", "--reaction-time", "balanced"):
        assert option in text


@pytest.mark.parametrize("ending", list(HEADS))
def test_a_drawing_is_a_whole_file_and_the_same_every_time(own, tmp_path, ending):
    first, second = tmp_path / f"a{ending}", tmp_path / "new" / f"b{ending}"
    assert main(["policy", "show", str(own), "balanced", "--out", str(first)]) == 0
    assert main(["policy", "show", str(own), "balanced", "--out", str(second)]) == 0
    assert first.read_bytes().startswith(HEADS[ending])
    assert first.read_bytes() == second.read_bytes()
    assert not list(tmp_path.rglob("*.part"))


def test_the_table_is_what_the_adapter_gives(own, capsys):
    assert main(["policy", "show", str(own), "--out", "none"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = {float(line.split()[0]): line.split() for line in lines[2:-1]}
    assert lines[0] == str(own)
    assert rows[0.0][1:3] == ["1.20", "m"]
    assert rows[1.0][1:3] == ["0.50", "m"]
    policy = AwarenessPolicy.from_yaml(own)
    robot = RobotProfile([[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]], 1.5, 1.0, 1.0, 0.3)
    for alpha, row in rows.items():
        for distance, shown in zip((1.0, 2.0, 3.0, 5.0), row[5::2], strict=True):
            adapter = NavAdapter(policy, robot)
            for step in range(60):
                now = 0.05 * step
                x = 0.3 + BODY_RADIUS_M + distance
                track = PersonTrack(
                    1, now, "confirmed", [x, 0.0], [0.0, 0.0], np.zeros((4, 4)), alpha, 0.0, alpha,
                    1.75, 0.0,
                )  # fmt: skip
                result = adapter.update((track,), RobotState(now, [0.0, 0.0], 0.0, 0.0, 0.0), now)
            assert float(shown) == pytest.approx(result.speed_limit_mps, abs=0.006)
            settled = settled_speed_limit_mps(policy, robot, distance, alpha)
            assert float(settled) == pytest.approx(result.speed_limit_mps, abs=1e-9)
        radius = result.obstacles[0].radius_m
        assert radius == pytest.approx(float(settled_radius_m(policy, alpha)))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["balancd"], "did you mean 'balanced'"),
        (["nowhere.yaml"], "cannot read nowhere.yaml"),
        (["balanced", "--out", "drawing.gif"], "--out must end in .png, .svg, .pdf or be none"),
        (["balanced", "--max-speed", "0"], "--max-speed (m/s) must lie in (0, inf)"),
        (["balanced", "--deceleration", "nan"], "--deceleration (m/s²) must be finite"),
        (["balanced", "--reaction-time", "-1"], "--reaction-time (s) must lie in [0, inf)"),
        (["balanced", "--farthest", "0"], "--farthest (m) must lie in [0.5, 100]"),
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
    ("blocked", "out", "status", "said"),
    [
        (["pybullet", "av"], "a.png", 0, ""),
        (["pybullet", "av", "matplotlib"], "none", 0, ""),
        (["pybullet", "av", "matplotlib"], "a.png", 2, install_command("plot")),
    ],
)
def test_no_simulator_is_needed(blocked, out, status, said, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", BLOCKED.format(blocked=blocked, out=out)],
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == status, done.stderr
    assert said in done.stderr
    assert (tmp_path / "a.png").exists() is (status == 0 and out != "none")


def test_without_matplotlib_the_table_is_printed_and_a_remark_says_why_there_is_no_plot(
    monkeypatch, capsys, tmp_path
):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.chdir(tmp_path)
    assert main(["policy", "show", "balanced"]) == 0
    printed = capsys.readouterr()
    assert printed.out.startswith("balanced\n")
    assert install_command("plot") in printed.err
    assert list(tmp_path.iterdir()) == []
