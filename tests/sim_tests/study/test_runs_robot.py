"""Runs with another robot: its scenarios, their planners, and the command."""

from __future__ import annotations

import pytest

from awarenav.cli import main
from sim_tests import SimError
from sim_tests.actors.robot import RobotModel
from sim_tests.study.runs import job_key, make_planner, plan_jobs, template_of
from sim_tests.study.scorecard._plan import plan_comparison


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


def test_a_comparison_of_planners_takes_a_robot() -> None:
    _, jobs = plan_comparison(
        ["straight_on"],
        ["crossing_from_left"],
        ["balanced"],
        (0,),
        perception="truth",
        robot="delivery",
    )
    assert {job_key(job).scenario for job in jobs} == {"crossing_from_left_delivery"}


def test_the_command_names_the_robots_that_there_are(tmp_path, capsys) -> None:
    words = ["crossings", "--robot", "tank", "--scenario", "crossing_from_left"]
    assert main([*words, "--out", str(tmp_path / "run")]) == 2
    assert "'delivery', 'forklift', 'nova_carter', 'omni', got 'tank'" in capsys.readouterr().err
