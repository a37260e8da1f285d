"""The text that names a population, and how its people hear."""

from __future__ import annotations

import pytest

from sim_tests import Scenario
from sim_tests.actors.behaviour import Hearing
from sim_tests.world.errors import SimError


def test_scenarios_and_their_draws_take_it_and_keep_the_rest() -> None:
    text = "recorded,answers=0.8,startles=0.2"
    for owner in (Scenario.shipped("late_glance"), Scenario.shipped("late_glance").draw(1)):
        changed = owner.with_population(text)
        assert changed.population == "recorded"
        assert changed.hearing == Hearing(answers=0.8, startles=0.2)
        again = changed.with_population("habituation=0.5")
        assert again.population == "recorded"
        assert again.hearing == Hearing(answers=0.8, startles=0.2, habituation=0.5)


def test_numbers_alone_leave_people_as_they_are() -> None:
    scenario = Scenario.shipped("crossing_distracted")
    changed = scenario.with_population("answers=0.3")
    assert (changed.population, changed.people) == (scenario.population, scenario.people)
    assert changed.hearing.changes_text == "answers=0.3"


def test_the_written_scenario_holds_them() -> None:
    changed = Scenario.shipped("late_glance").with_population("answers=0.3")
    assert Scenario.from_text(changed.to_text()).hearing.answers == 0.3
    assert Scenario.from_text(changed.draw(2).to_text()).hearing.answers == 0.3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("odd", "population must be one of classic, recorded, got 'odd'"),
        ("recorded,odd", "KEY=VALUE .*habituation.*got 'odd'"),
        ("recorded,answer=0.3", "answers, startles.*did you mean 'answers'"),
        ("recorded,", "KEY=VALUE"),
        ("answers=lots", "answers of a population must be a number, got 'answers=lots'"),
        ("answers=0.3,answers=0.4", "names answers twice"),
        ("answers=0.3,recorded", "got 'recorded'"),
        ("answers=1.5", "answers.*less than or equal to 1"),
        ("answers=nan", "answers"),
        ("heard_within_m=20", "heard_within_m must be at most not_heard_beyond_m"),
    ],
)
def test_another_text_is_refused(text: str, message: str) -> None:
    for owner in (Scenario.shipped("late_glance"), Scenario.shipped("late_glance").draw(1)):
        with pytest.raises(SimError, match=message):
            owner.with_population(text)
