"""The same files after kills at any instant."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT
from run_scenes import SHORT

from awarenav.cli import main

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")

PROGRAM = Path(__file__).with_name("kill_commands.py")
COMMANDS = {
    "crossings": (
        ["--episodes", "4", "--workers", "1", "--no-report"],
        ["episodes.csv", "episodes.parquet", "jobs.jsonl"],
    ),
    "tune": (
        ["--trials", "4", "--generation", "2", "--episodes", "1", "--held-out", "1"],
        ["trials.csv", "chosen.json", "importances.json", "chosen/*.yaml", "episodes.jsonl"],
    ),
    "falsify": (
        ["--episodes", "8", "--generation", "4", "--worst", "2"],
        ["episodes.csv", "summary.json", "worst_*.yaml", "policy.yaml", "falsify.png"],
    ),
    "render": (
        ["--frames", "12", "--scenes", "3", "--size", "160x120", "--workers", "1"],
        ["*.png", "truth.jsonl", "camera.yaml", "render.yaml"],
    ),
    "estimate": (["--threads", "1"], ["estimates.jsonl"]),
}


def kill(name, kills, tmp_path, *more):
    """Kill a command; return what the program says."""
    options, files = COMMANDS[name]
    words = [name, *options, *more]
    if name == "estimate":
        pictures = tmp_path / "pictures"
        made = ["render", "--frames", "8", "--size", "320x240", "--workers", "1"]
        assert main([*made, "--out", str(pictures)]) == 0
        words.append(str(pictures))
    elif name != "render":
        scenario = tmp_path / "short.yaml"
        scenario.write_text(SHORT.format(name="short"))
        words += ["--scenario", str(scenario), "--perception", "truth"]
    task = {
        "words": words,
        "out": "estimates.jsonl" if name == "estimate" else "out",
        "results": files,
        "kills": kills,
        "seed": 20,
        "folder": str(tmp_path),
    }
    found = subprocess.run(
        [sys.executable, str(PROGRAM), json.dumps(task)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path[1:]])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert found.returncode == 0, found.stdout + found.stderr
    return found.stdout


@pytest.mark.full
@pytest.mark.parametrize("name", COMMANDS)
def test_ten_kills_at_random_instants_change_no_file(name, tmp_path):
    said = kill(name, 10, tmp_path)
    print(name, said)
    assert said.startswith("10 kills")
