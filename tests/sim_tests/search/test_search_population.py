"""Runs, tuning and falsification take the people of another population."""

from __future__ import annotations

from sim_tests.scenario import ScenarioTemplate
from sim_tests.search._files import common_settings, templates_of
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
