"""The crossings of the demonstration with another robot, and among recorded people."""

from __future__ import annotations

import pytest

from awarenav.cli import main
from sim_tests.actors.robot import RobotModel
from sim_tests.demo._comparison import compare_policies, compared_scenarios
from sim_tests.scenario import Scenario


def test_without_options_the_crossings_are_the_shipped_ones() -> None:
    names = ("crossing_attentive", "crossing_distracted")
    assert compared_scenarios("", "") == tuple(Scenario.shipped(name) for name in names)


def test_the_crossings_have_the_robot_and_the_people_asked_for() -> None:
    attentive, distracted = compared_scenarios("omni", "recorded")
    for scenario in (attentive, distracted):
        assert scenario.robot_model == RobotModel.shipped("omni")
        assert scenario.population == "recorded"
    assert attentive.people[0].route == distracted.people[0].route
    assert [each.people[0].glances.watches for each in (attentive, distracted)] == [True, False]


@pytest.mark.parametrize(
    ("words", "message"),
    [(["--robot", "tank"], "got 'tank'"), (["--population", "modern"], "got 'modern'")],
)
def test_unknown_names_are_refused_and_nothing_is_written(words, message, tmp_path, capsys) -> None:
    out = tmp_path / "demo"
    assert main(["demo", *words, "--out", str(out)]) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.full
def test_all_its_rows_are_driven_by_the_robot() -> None:
    rows = compare_policies(3, robot="delivery", population="recorded")
    assert [row.label for row in rows][1] == "today's AMR"
    delivery = RobotModel.shipped("delivery").profile
    for row in rows:
        assert row.result.success
        assert (row.result.robot.footprint_m == delivery.footprint_m).all()
        assert row.result.robot.max_speed_mps == delivery.max_speed_mps
