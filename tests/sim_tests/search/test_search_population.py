"""Runs, tuning and falsification take the people of another population."""

from __future__ import annotations

import numpy as np
import pytest

from sim_tests import run_crossing
from sim_tests.actors.behaviour import FASTEST_RECORDED_MPS, draw_person
from sim_tests.crossing.planner import StraightOn
from sim_tests.scenario import ScenarioTemplate
from sim_tests.search._files import common_settings, templates_of
from sim_tests.search.falsify._joint_parameters import COMPANION
from sim_tests.search.falsify._scenario_space import ScenarioSpace
from sim_tests.study.runs import plan_jobs

SCENARIOS = ("late_glance", "crossing_attentive")


def test_the_jobs_of_a_run_hold_the_population() -> None:
    jobs = plan_jobs(SCENARIOS, ["blind"], [0], population="recorded")
    drawn = [ScenarioTemplate.from_text(job.scenario).for_seed(0) for job in jobs]
    assert [each.population for each in drawn] == ["recorded", "recorded"]
    assert all(each.people and not each.workers for each in drawn)
    (own,) = plan_jobs(["late_glance"], ["blind"], [0])
    assert "population" not in own.scenario, "an older run is continued with the same text"


def test_a_search_keeps_the_population_in_its_settings() -> None:
    settings = common_settings("balanced", SCENARIOS, "", "recorded")
    for template in templates_of(settings["scenarios"]):
        assert template.median().population == "recorded"
        space = ScenarioSpace(template, 2)
        varied = space.scenario(space.neutral)
        assert varied.population == "recorded"
        assert varied.workers == ()
        assert len(varied.people) == 1


def _space(name: str) -> ScenarioSpace:
    return ScenarioSpace(ScenarioTemplate.shipped(name).with_population("recorded"))


def _people(space: ScenarioSpace, **levers: float):
    values = {key.replace("__", "."): value for key, value in levers.items()}
    assert set(values) <= set(space.neutral)
    return space.scenario({**space.neutral, **values}).people


def test_a_search_begins_at_the_medians_of_recorded_people() -> None:
    space = _space("crossing_from_left")
    (varied,) = _people(space)
    (written,) = space.template.median().people
    drawn = [draw_person(written, np.random.default_rng(seed)) for seed in range(400)]
    speeds = np.array([each.speed_mps for each in drawn])
    assert np.ptp(speeds) > 0.5
    assert varied.speed_mps == pytest.approx(np.median(speeds), abs=0.02)
    assert varied.glances == drawn[0].glances != written.glances
    assert varied.route == written.route
    assert varied.as_written
    assert not written.as_written


def test_what_the_search_sets_is_not_drawn_again() -> None:
    levers = {"speed_mps": 2.4, "glance_median_s": 2.0, "looks": 0.5}
    (varied,) = _people(
        _space("intersection"), **{f"people__0__{key}": value for key, value in levers.items()}
    )
    assert draw_person(varied, np.random.default_rng(3)) is varied
    assert (varied.speed_mps, varied.glances.glance_median_s) == (2.4, 2.0)
    assert varied.glances.looker_share == 1.0
    assert _space("intersection").ranges["people.0.speed_mps"].high == FASTEST_RECORDED_MPS
    classic = ScenarioSpace(ScenarioTemplate.shipped("intersection")).ranges
    assert classic["people.0.speed_mps"].high == 2.0
    _, companion = _people(_space("crossing_from_left"), companion__kind=0.5, companion__pace=0.8)
    assert companion.name == COMPANION
    assert companion.as_written


@pytest.mark.parametrize("speed_mps", [0.7, 1.7])
def test_recorded_people_walk_at_the_speed_of_the_search(speed_mps: float) -> None:
    space = _space("crossing_from_left")
    scenario = space.scenario({**space.neutral, "people.0.speed_mps": speed_mps})
    (person,) = scenario.people
    lasts = {"duration_s": person.start_s + 3.5}
    result = run_crossing(
        scenario.model_copy(update=lasts), policy="blind", planner=StraightOn(0.05), seed=5
    )
    places = np.array([frame.truth[0].position_odom_m for frame in result.frames])
    walked_m = np.hypot(*(places[-1] - places[-1 - 40]))  # the last two seconds
    assert walked_m / 2.0 == pytest.approx(speed_mps, abs=0.15)
