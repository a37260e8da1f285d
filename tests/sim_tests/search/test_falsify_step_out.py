"""Falsification among people who set off as the robot comes: the search chooses the moment."""

from __future__ import annotations

import click
import pytest

from sim_tests import ScenarioTemplate, shipped_scenarios
from sim_tests.search.falsify import ScenarioSpace
from sim_tests.search.falsify.command import falsify

MOMENT = "people.0.sets_off_within_m"


@pytest.mark.parametrize("name", shipped_scenarios("step_out"))
def test_the_robots_distance_is_a_lever_in_place_of_the_clock(name: str) -> None:
    space = ScenarioSpace(ScenarioTemplate.shipped(name))
    assert "people.0.start_s" not in space.parameters
    moment = space.parameters[MOMENT]
    assert moment.neutral == pytest.approx(1.2, abs=0.1)
    for metres in (0.3, 2.0, 4.0):
        (person, *_) = space.scenario({**space.neutral, MOMENT: metres}).people
        assert person.sets_off_within_m == pytest.approx(metres)
        assert person.start_s == 0.0
    usual = ScenarioSpace(ScenarioTemplate.shipped("runs_out"))
    assert "people.0.start_s" in usual.parameters


def test_the_search_takes_them_unless_others_are_named() -> None:
    (option,) = (each for each in falsify.params if each.name == "scenario")
    assert tuple(option.get_default(click.Context(falsify))) == ("all", "step_out")
