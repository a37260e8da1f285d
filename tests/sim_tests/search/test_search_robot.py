"""Tuning and falsification with another robot, which their files and next commands keep."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from awarenav.cli import main
from sim_tests import Scenario, SimError
from sim_tests.actors.robot import NOVA_CARTER, RobotModel
from sim_tests.scenario import ScenarioTemplate
from sim_tests.search._files import common_settings, templates_of
from sim_tests.search.falsify._person_parameters import person_path
from sim_tests.search.falsify._scenario_space import ScenarioSpace
from sim_tests.search.falsify._variation import ROBOT_CLEARANCE_M
from sim_tests.search.tune._settings import held_out_scenarios

_SCENARIO = """
name: crosses_ahead
description: A person crosses the robot's way and does not look.
duration_s: 3.0
control_hz: 10.0
layout: {x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0}
robot: {goal_x_m: 3.0}
people:
  - name: worker
    route: [{x_m: 2.2, y_m: -1.2}, {x_m: 2.2, y_m: 1.2}]
    glances: {notices_within_m: 0.0}
"""


def test_the_worst_cases_have_the_robot_and_another_one_cannot_go_on(tmp_path, capsys):
    (tmp_path / "mine.yaml").write_text(_SCENARIO)
    out = tmp_path / "out"
    words = f"falsify --scenario {tmp_path / 'mine.yaml'} --perception truth --worst 1 --out {out}"
    words += " --episodes 2 --generation 2 --population recorded --planner straight_on --seed 3"
    assert main([*words.split(), "--robot", "forklift"]) in (0, 1)
    printed = capsys.readouterr().out
    assert "DOES NOT REPLAY" not in printed
    forklift = RobotModel.shipped("forklift")
    worst = Scenario.from_yaml(out / "worst_001.yaml")
    assert worst.name == "crosses_ahead_forklift_worst_001"
    assert worst.robot_model == forklift
    assert worst.population == "recorded"
    assert worst.people[0].as_written
    (template,) = templates_of(json.loads((out / "falsify.json").read_text())["scenarios"])
    assert template.median().robot_model == forklift
    (following,) = (line for line in printed.splitlines() if line.startswith("Next: "))
    if "worst_001.yaml" in following:  # the file has both
        assert "--robot" not in following
    else:
        assert "--robot forklift --population recorded" in following
    assert main([*words.split(), "--robot", "omni", "--resume"]) == 2
    assert "was begun with another scenarios" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["tune", "falsify"])
def test_an_unknown_robot_is_refused_and_nothing_is_written(command, tmp_path, capsys):
    out = tmp_path / "out"
    assert main([command, "--robot", "forklft", "--out", str(out)]) == 2
    assert "'forklft'; did you mean 'forklift'" in capsys.readouterr().err
    assert not out.exists()


def test_scenarios_are_held_out_by_their_names_with_or_without_the_robot():
    names = ("blind_corner", "late_glance", "runs_out")
    settings = common_settings("balanced", names, "", "", "omni")
    templates = templates_of(settings["scenarios"])
    assert [each.name for each in templates] == [f"{name}_omni" for name in names]
    for given in ("runs_out", "runs_out_omni"):
        assert held_out_scenarios([given], templates) == ("runs_out_omni",)
    for given in (names, (*names, "runs_out_omni")):
        with pytest.raises(SimError, match="must leave a scenario to tune on"):
            held_out_scenarios(given, templates)


def test_people_begin_farther_from_a_long_robot():
    model = RobotModel.shipped("forklift")
    longer_m = model.profile.circumscribed_radius_m - NOVA_CARTER.circumscribed_radius_m
    assert longer_m > 0.8
    data = yaml.safe_load(_SCENARIO)
    data["people"][0]["route"] = [{"x_m": 0.0, "y_m": 2.4}, {"x_m": 4.0, "y_m": 2.4}]
    nearest = []
    for more in ({}, {"robot_model": "forklift"}):
        space = ScenarioSpace(ScenarioTemplate({**data, **more}))
        rng = np.random.default_rng(0)
        starts = []
        for _ in range(40):
            values = {key: rng.uniform(each.low, each.high) for key, each in space.ranges.items()}
            person = space.scenario(values).people[0].model_dump()
            starts.append(float(np.hypot(*person_path(person)[0])))
        nearest.append(min(starts))
    assert ROBOT_CLEARANCE_M <= nearest[0] < ROBOT_CLEARANCE_M + longer_m <= nearest[1] + 1e-9
