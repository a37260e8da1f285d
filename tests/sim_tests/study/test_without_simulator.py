"""Scenarios, planners and finished runs need no PyBullet; what simulates says so at once."""

from __future__ import annotations

import json
import subprocess
import sys

from paths import ROOT
from report_runs import made_up_run

from perception.installation import install_command

CODE = """
import json, sys
for each in ("pybullet", "filelock", "av", "moderngl"):
    sys.modules[each] = None
from awarenav.cli import main
print(json.dumps([main(command) for command in json.loads(sys.argv[1])]), file=sys.stderr)
"""


def statuses_without_pybullet(commands, cwd) -> tuple[list[int], str]:
    """The exit statuses of the commands, and all that they wrote to standard error."""
    done = subprocess.run(
        [sys.executable, "-c", CODE, json.dumps(commands)],
        cwd=cwd,
        env={"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    said, last = done.stderr.rstrip("\n").rpartition("\n")[::2]
    return json.loads(last), said


def test_scenarios_planners_and_finished_runs_are_read_without_pybullet(tmp_path) -> None:
    made_up_run(scenarios=2, seeds=2).write(tmp_path / "run")
    commands = [
        ["scenario", "list"],
        ["scenario", "show", "crossing_attentive"],
        ["planners", "list"],
        ["compare", "run"],
        ["report", "run", "--no-stills"],
    ]
    found, said = statuses_without_pybullet(commands, tmp_path)
    assert found == [0] * len(commands), said
    assert (tmp_path / "run" / "report.html").stat().st_size > 0


def test_what_simulates_refuses_without_pybullet_and_writes_nothing(tmp_path) -> None:
    commands = [
        ["crossings", "--scenario", "crossing_attentive", "--out", "run"],
        ["demo", "--out", "demo"],
        ["render", "--out", "images"],
        ["tune", "--scenario", "crossing_attentive", "--out", "tune"],
        ["falsify", "--scenario", "crossing_attentive", "--out", "falsify"],
        ["watch", "crossing_attentive"],
        ["replay", "run", "0"],
        ["measures", "run"],
        ["planners", "compare", "json:JSONDecoder"],
    ]
    found, said = statuses_without_pybullet(commands, tmp_path)
    assert found == [2] * len(commands), said
    assert said.count("the simulator needs ") == len(commands)
    assert said.count(install_command("sim,bench")) == len(commands)
    assert not list(tmp_path.iterdir())
