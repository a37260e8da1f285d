"""People of a population: its text, and the waits of scripted workers that they keep."""

from __future__ import annotations

import pytest

from sim_tests import Scenario, ScenarioTemplate
from sim_tests.actors.behaviour import Hearing
from sim_tests.world.errors import SimError


def test_scenarios_and_templates_take_it_and_keep_the_rest() -> None:
    text = "recorded,answers=0.8,startles=0.2"
    for owner in (Scenario.shipped("late_glance"), ScenarioTemplate.shipped("late_glance")):
        changed = owner.with_population(text)
        scenario = changed if isinstance(changed, Scenario) else changed.median()
        assert scenario.population == "recorded"
        assert scenario.hearing == Hearing(answers=0.8, startles=0.2)
        again = changed.with_population("habituation=0.5")
        scenario = again if isinstance(again, Scenario) else again.median()
        assert scenario.population == "recorded"
        assert scenario.hearing == Hearing(answers=0.8, startles=0.2, habituation=0.5)


def test_numbers_alone_leave_people_as_they_are() -> None:
    scenario = Scenario.shipped("crossing_distracted")
    changed = scenario.with_population("answers=0.3")
    assert (changed.population, changed.workers) == (scenario.population, scenario.workers)
    assert changed.hearing.changes_text == "answers=0.3"


def test_the_written_scenario_holds_them() -> None:
    changed = ScenarioTemplate.shipped("late_glance").with_population("answers=0.3")
    assert ScenarioTemplate.from_text(changed.to_text()).median().hearing.answers == 0.3
    text = changed.median().to_text()
    assert ScenarioTemplate.from_text(text).median().hearing.answers == 0.3


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
    for owner in (Scenario.shipped("late_glance"), ScenarioTemplate.shipped("late_glance")):
        with pytest.raises(SimError, match=message):
            owner.with_population(text)


def people_of(*path: tuple[float, float, float]) -> tuple[float, list[tuple[float, float]], float]:
    """Return start, pauses and speed of the person with the task of a script of (t, x, y)."""
    script = {"path": [{"t_s": t, "x_m": x, "y_m": y} for t, x, y in path]}
    data = {"name": "s", "duration_s": 9.0, "layout": "open", "workers": [script]}
    data["robot"] = {"goal_x_m": 9.0}
    (person,) = Scenario.model_validate(data).with_population("recorded").people
    return person.start_s, [(each.at_m, each.for_s) for each in person.pauses], person.speed_mps


def test_somebody_who_stands_first_starts_after_that():
    start_s, pauses, speed = people_of((0, 3, 2), (4, 3, 2), (7, 3, -1))
    assert (start_s, pauses) == (4.0, [])
    assert speed == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("path", "start_s", "pauses"),
    [
        (((1, 3, 2), (2, 3, 2), (6, 3, 2), (8, 3, 0)), 6.0, []),  # two waits at the first point
        (((-5, 3, 2), (2.5, 3, 2), (5, 3, 0)), 2.5, []),  # it began before the episode
        (((-5, 3, 2), (-2, 3, 2), (5, 3, 0)), 0.0, []),
        (((1, 3, 2), (3, 3, 0), (5, 3, 0), (7, 3, -2)), 1.0, [(2.0, 2.0)]),
        (((0, 3, 2), (3, 3, 2), (5, 3, 0), (8, 3, 0), (9, 3, -1)), 3.0, [(2.0, 3.0)]),
        (((0, 3, 2), (9, 3, 2)), 0.0, []),  # stands all the time
    ],
)
def test_waits_are_kept_where_they_are(path, start_s, pauses):
    found_s, found, _ = people_of(*path)
    assert found_s == start_s
    assert found == pauses
