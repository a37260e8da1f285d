"""The further sets of shipped scenarios: their place beside the first, promises, crossings."""

from __future__ import annotations

import pytest

from awarenav.cli import main
from sim_tests import Scenario, SimError, run_crossing, shipped_scenarios
from sim_tests.actors.behaviour import PersonSpec
from sim_tests.crossing.sensors._camera import unusual_size_probability
from sim_tests.scenario import SCENARIO_SETS
from sim_tests.study.runs import named_scenarios
from sim_tests.study.scenarios._validate import AttentionCheck

NAMES = shipped_scenarios("guidelines")
# Short ones; the others take longer.
QUICK = ("narrow_doorway",)


def test_the_sets_share_no_scenario_and_all_stays_as_it_was_measured() -> None:
    assert SCENARIO_SETS == ("all", "guidelines", "step_out", "at_work")
    assert shipped_scenarios() == shipped_scenarios("all")
    assert not set(NAMES) & set(shipped_scenarios())
    assert len(named_scenarios(["all"])) == 23
    assert [each.name for each in named_scenarios(["guidelines"])] == list(NAMES)
    assert len(named_scenarios(["all", "guidelines", NAMES[0]])) == 23 + len(NAMES)
    sets = "'all', 'guidelines', 'step_out', 'at_work'"
    with pytest.raises(SimError, match=f"did you mean 'guidelines'. It must be one of {sets}"):
        shipped_scenarios("guideline")
    for name in NAMES:
        assert Scenario.shipped(f"{name}@1").name == Scenario.shipped(name).name == name


def test_the_list_shows_all_sets(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenario", "list"]) == 0
    first, rest = capsys.readouterr().out.split("--scenario guidelines\n")
    second, third = rest.split("--scenario step_out\n")
    assert first.startswith("--scenario all\n")
    assert all(f"{name}@" in second and f"{name}@" not in first for name in NAMES)
    assert all(f"{name}@" in first for name in shipped_scenarios())
    third, fourth = third.split("--scenario at_work\n")
    assert all(f"{name}@" in third for name in shipped_scenarios("step_out"))
    assert all(f"{name}@" in fourth for name in shipped_scenarios("at_work"))


def test_the_child_is_drawn_in_its_size_and_the_robot_is_told_of_unusual_sizes() -> None:
    scenario = Scenario.shipped("child_visitor")
    statures = [scenario.draw(seed).people[0].stature_m for seed in range(40)]
    assert 1.05 <= min(statures) < 1.1
    assert 1.25 < max(statures) <= 1.3
    for name in ("child_visitor", "kneels_at_work", "sits_at_work"):
        assert unusual_size_probability(Scenario.shipped(name)) > 0.0
    assert unusual_size_probability(Scenario.shipped("narrow_doorway")) == 0.0


def follower_gap_m(keeps_off_m: float) -> float:
    """Return the least distance of the follower's centre from the robot on its way."""
    scenario = Scenario.shipped("leads_person")
    (person,) = scenario.people
    behind = PersonSpec.model_validate({**person.model_dump(), "keeps_off_m": keeps_off_m})
    short = scenario.model_copy(update={"people": (behind,), "duration_s": 8.0})
    return run_crossing(short, policy="balanced", seed=0).min_separation_m


def test_a_follower_keeps_the_distance_that_it_is_given() -> None:
    near_m, far_m = follower_gap_m(0.7), follower_gap_m(1.5)
    # From the body's centre; half a body is about 0.25 m deep.
    assert 0.3 < near_m < 0.9
    assert near_m + 0.3 < far_m < near_m + 1.1


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.full) for name in NAMES],
)
def test_the_robot_touches_no_one_and_people_look_as_the_label_says(name: str) -> None:
    scenario = Scenario.shipped(name)
    result = run_crossing(scenario.draw(1), policy="balanced", seed=1)
    assert result.success
    assert result.contact_by != "robot"
    assert AttentionCheck.of(scenario, [result]).contradictions == ()
