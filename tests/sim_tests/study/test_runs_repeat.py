"""An episode is a function of its line; planners that do not repeat themselves are named."""

import random

import pytest
from run_scenes import SHORT, short, short_jobs

from awarenav.cli import main
from sim_tests.search import EpisodeRunner
from sim_tests.study.measures import read_records, summarise, summary_text
from sim_tests.study.runs import attempt, in_parallel, plan_jobs, run_episode, run_jobs

PLANNERS = """
import random
import time
import numpy as np

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
"""


@pytest.fixture
def drawing(tmp_path, monkeypatch):
    """Return the folder of the planners, on the import path of this process and its children."""
    name = f"drawing_{random.randrange(10**9)}"
    (tmp_path / f"{name}.py").write_text(PLANNERS, "utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    return name


def test_a_planner_that_draws_while_it_is_imported_draws_the_same_in_every_process(drawing):
    (job,) = short_jobs(1, planners=[f"{drawing}:DrawnAtImport"])[::2]
    (here,) = (outcome.record for _, outcome in in_parallel(attempt, [job], workers=1))
    ((_, there),) = in_parallel(attempt, [job], workers=1, own_process=True)
    assert not here.error
    assert there.record == here


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
