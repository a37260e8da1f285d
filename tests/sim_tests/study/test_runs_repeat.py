"""An episode is a function of its line: seeds for planners and torch; other planners are named."""

import json
import os
import random
import subprocess
import sys
from dataclasses import astuple
from pathlib import Path

import pytest
from paths import ROOT
from run_scenes import SHORT, short, short_jobs

from awarenav.cli import main
from sim_tests.search import EpisodeRunner
from sim_tests.study.measures import RECORD_COLUMNS, read_records, summarise, summary_text
from sim_tests.study.runs import plan_jobs, run_episode, run_jobs

HERE = Path(__file__).parent
COLUMN = RECORD_COLUMNS.index("path_length_m")
AGAIN = RECORD_COLUMNS.index("nondeterministic")

PLANNERS = """
import random
import time
import numpy as np
{torch_at_the_top}

class Straight:
    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return self.speed_mps(), 0.0

class Seeded(Straight):
    def __init__(self, *, seed):
        self.rng = np.random.default_rng(seed)

    def speed_mps(self):
        return 0.2 + 0.4 * self.rng.random()

class Unseeded(Straight):
    def __init__(self):
        self.rng = np.random.default_rng()

    def speed_mps(self):
        return 0.2 + 0.4 * self.rng.random()

DRAWN = np.random.random() + random.random()

class DrawnAtImport(Straight):
    def speed_mps(self):
        return 0.2 + 0.2 * DRAWN

class Torch(Straight):
    def __init__(self):
        import torch
        self.weight = torch.rand()

    def speed_mps(self):
        import torch
        return 0.2 + 0.2 * self.weight + 0.2 * torch.rand()

class LateTorch(Straight):
    def speed_mps(self):
        import torch
        return 0.2 + 0.4 * torch.rand()
"""


def run_script(tmp_path, lines, torch_at_the_top="import torch"):
    """Return what a program prints as JSON, in a process of its own with a fake torch."""
    (tmp_path / "torch.py").write_text((HERE / "fake_torch.py").read_text("utf-8"), "utf-8")
    (tmp_path / "drawing.py").write_text(
        PLANNERS.format(torch_at_the_top=torch_at_the_top), "utf-8"
    )
    program = "\n".join(
        [
            "import json, sys",
            "from dataclasses import astuple",
            "from run_scenes import short_jobs",
            "from sim_tests.study.runs import run_episode",
            "def rows(planner, episodes=1):",
            "    jobs = short_jobs(episodes, planners=[f'drawing:{planner}'])[::2]",
            "    records = [run_episode(job) for job in jobs]",
            "    assert not any(record.error for record in records), records",
            "    return [astuple(record) for record in records]",
            lines,
        ]
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(HERE)])},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize(
    ("planner", "top"),
    [
        ("Torch", "import torch"),
        pytest.param("Torch", "", marks=pytest.mark.full),
        ("LateTorch", ""),
    ],
)
def test_an_episode_with_torch_is_a_function_of_its_line(tmp_path, planner, top):
    """The first and the last episode of a process give the same row, in any order of seeds."""
    out = run_script(
        tmp_path,
        f"first = rows('{planner}', 2)\n"
        "import torch\n"
        "torch.set_num_threads(3)\n"
        "torch.manual_seed(99)\n"
        "expected = torch.rand()\n"
        "torch.manual_seed(99)\n"
        f"again = rows('{planner}', 2)\n"
        "print(json.dumps([first, again, expected == torch.rand(), torch.get_num_threads()]))",
        top,
    )
    first, again, state_kept, threads = out
    assert again == first
    assert first[0][COLUMN] != first[1][COLUMN]
    assert not any(row[AGAIN] for row in first), "taken for a planner that is not deterministic"
    assert state_kept, "the state of torch's generator was not restored"
    assert threads == 3


@pytest.fixture
def drawing(tmp_path, monkeypatch):
    """Return the folder of the planners, on the import path of this process and its children."""
    name = f"drawing_{random.randrange(10**9)}"
    (tmp_path / f"{name}.py").write_text(PLANNERS.format(torch_at_the_top=""), "utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    return name


def test_a_planner_that_draws_while_it_is_imported_draws_the_same_in_every_process(
    drawing, tmp_path
):
    """And the runs never import torch themselves."""
    program = "print(json.dumps([rows('DrawnAtImport'), 'torch' in sys.modules]))"
    rows, torch_imported = run_script(tmp_path, program, torch_at_the_top="")
    (job,) = short_jobs(1, planners=[f"{drawing}:DrawnAtImport"])[::2]
    assert rows == [list(astuple(run_episode(job)))]
    assert not torch_imported


def test_the_seed_of_the_episode_is_handed_to_a_planner_that_takes_it(drawing):
    first, second = short_jobs(2, planners=[f"{drawing}:Seeded"])[::2]
    record = run_episode(first)
    assert run_episode(first) == record
    assert not record.nondeterministic
    assert run_episode(second).path_length_m != record.path_length_m


def test_a_planner_that_is_not_deterministic_is_found_and_named(drawing, tmp_path):
    jobs = short_jobs(1, planners=[f"{drawing}:Unseeded", f"{drawing}:Seeded", ""])
    records = run_jobs(jobs, tmp_path / "run", workers=1)
    assert [each.planner for each in records if each.nondeterministic] == ["Unseeded"] * 2
    assert read_records(tmp_path / "run" / "episodes.csv") == records
    summary = summarise(records)
    assert {row.variant: row.nondeterministic for row in summary.policies}[
        "balanced, Unseeded"
    ] == 1
    assert "balanced, Unseeded: the planner is not deterministic" in summary_text(summary)


def test_a_planner_of_the_straight_encounter_is_checked_too(drawing):
    template = short()
    straight = template.from_text(
        SHORT.format(name="straight").replace(
            "goal_x_m: 0.6", "goal_x_m: 0.6, straight_on_speed_mps: 0.3"
        )
    )
    (job,) = plan_jobs(
        [straight], ["blind"], [0], planners=[f"{drawing}:Unseeded"], perception="truth"
    )
    record = run_episode(job)
    assert not record.error
    assert record.nondeterministic


def test_crossings_and_the_report_say_that_a_planner_is_not_deterministic(
    drawing, tmp_path, monkeypatch, capfd
):
    pytest.importorskip("jinja2")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.yaml").write_text(SHORT.format(name="short"))
    arguments = ["crossings", "--scenario", "short.yaml", "--policy", "blind", "--episodes", "2"]
    arguments += ["--perception", "truth", "--planner", f"{drawing}:Unseeded", "--workers", "1"]
    assert main([*arguments, "--out", "out"]) == 0
    said = "Unseeded: the planner is not deterministic. In 2 of 2 episodes"
    assert said in capfd.readouterr().err
    assert said in (tmp_path / "out" / "report.html").read_text("utf-8")


def test_a_search_says_once_that_a_planner_is_not_deterministic(drawing, capfd):
    with EpisodeRunner(1, "test") as runner:
        for _ in range(2):
            runner.run(short_jobs(1, planners=[f"{drawing}:Unseeded"])[:1])
    assert capfd.readouterr().err.count("Unseeded: the planner is not deterministic") == 1
