"""Runs with another robot: its scenarios, their planners, and the command."""

from __future__ import annotations

import pytest
from run_scenes import SHORT

from awarenav.cli import main
from sim_tests import SimError
from sim_tests.actors.robot import RobotModel
from sim_tests.study.runs import (
    Conditions,
    job_key,
    make_planner,
    plan_jobs,
    read_jobs,
    template_of,
)
from sim_tests.study.watch._watch import _job


class Keeps:
    """A planner that keeps the robot it was made for."""

    def __init__(self, robot):
        self.robot = robot

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return 0.0, 0.0


def test_jobs_hold_the_robot_and_draw_fitted_scenarios() -> None:
    (job,) = plan_jobs(["crossing_from_left"], ["blind"], [4], robot="forklift")
    assert job_key(job).scenario == "crossing_from_left_forklift"
    scenario = template_of(job.scenario).for_seed(job.seed)
    assert scenario.robot_model == RobotModel.shipped("forklift")
    with pytest.raises(SimError, match="'forklft'; did you mean 'forklift'"):
        plan_jobs(["crossing_from_left"], ["blind"], [4], robot="forklft")


def test_planners_get_the_profile_of_the_robot() -> None:
    (job,) = plan_jobs(["crossing_from_left"], ["blind"], [0], robot="omni")
    planner = make_planner(f"{__name__}:Keeps", template_of(job.scenario).median())
    assert isinstance(planner, Keeps)
    assert planner.robot.drive == "holonomic"


def test_a_replay_has_the_robot_and_the_people_of_the_run(tmp_path, capsys) -> None:
    (tmp_path / "short.yaml").write_text(SHORT.format(name="short"))
    words = ["crossings", "--scenario", str(tmp_path / "short.yaml"), "--policy", "blind"]
    words += ["--perception", "truth", "--workers", "1", "--no-report", "--out", str(tmp_path)]
    assert main([*words, "--robot", "delivery", "--population", "recorded"]) == 0
    (job,) = read_jobs(tmp_path)
    scenario = template_of(job.scenario).for_seed(job.seed)
    assert scenario.robot_model == RobotModel.shipped("delivery")
    assert scenario.population == "recorded"
    capsys.readouterr()
    assert main(["replay", str(tmp_path), "0", "--no-video"]) == 0
    assert "short_delivery" in (text := capsys.readouterr().out)
    assert "The same row as in" in text


def test_a_crossing_is_watched_with_another_robot_and_population() -> None:
    values = {"scenario": "late_glance", "perception": "truth", "seed": 3}
    usual = Conditions.taken_from(dict(values))
    conditions = Conditions.taken_from({**values, "robot": "omni", "population": "recorded"})
    scenario = template_of(_job(conditions, "blind").scenario).for_seed(3)
    assert scenario.robot_model == RobotModel.shipped("omni")
    assert scenario.population == "recorded"
    (own,) = plan_jobs(["late_glance"], ["blind"], [3], perception="truth")
    assert _job(usual, "blind") == own


def test_the_command_names_the_robots_that_there_are(tmp_path, capsys) -> None:
    words = ["crossings", "--robot", "tank", "--scenario", "crossing_from_left"]
    assert main([*words, "--out", str(tmp_path / "run")]) == 2
    assert "'delivery', 'forklift', 'nova_carter', 'omni', got 'tank'" in capsys.readouterr().err
