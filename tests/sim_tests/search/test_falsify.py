from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from awarenav.cli import main
from sim_tests import Scenario, SimError
from sim_tests.scenario import ScenarioTemplate
from sim_tests.search._search import Outcome, Range
from sim_tests.search.falsify._falsify import FalsifySettings, _budget
from sim_tests.search.falsify._hunt import CONTACT, NOTHING, Hunt, score
from sim_tests.search.falsify._people_space import PeopleSpace
from sim_tests.search.falsify._person_levers import way_of
from sim_tests.search.falsify._script_levers import peaks, script_way
from sim_tests.search.falsify._way import RACK_CLEARANCE_M, bent, clearance_m
from sim_tests.search.falsify._worst import worst_finds
from sim_tests.study.measures import EpisodeRecord

_NAMES = ("crossing_from_left", "runs_out", "blind_corner", "walking_backwards", "crowd_of_eight")
_SCRIPTED = ("crossing_attentive", "paper_encounter")
_SPACES = {name: PeopleSpace(ScenarioTemplate.shipped(name)) for name in (*_NAMES, *_SCRIPTED)}


def _values(space: PeopleSpace, seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    return {name: rng.uniform(each.low, each.high) for name, each in space.ranges.items()}


@pytest.mark.parametrize("name", _SPACES)
def test_with_all_levers_neutral_the_scenario_is_as_it_was_written(name):
    space = _SPACES[name]
    written = space.template.median().model_copy(update={"start_jitter_s": 0.0})
    assert space.scenario(space.neutral) == written


@settings(max_examples=60)
@given(name=st.sampled_from(_NAMES), seed=st.integers(0, 2**32))
def test_people_keep_to_human_limits_and_out_of_racks(name, seed):
    space = _SPACES[name]
    median = space.template.median()
    scenario = space.scenario(_values(space, seed))
    assert scenario.model_copy(update={"people": ()}) == median.model_copy(update={"people": ()})
    boxes = median.layout.obstacle_boxes_odom
    for person, written in zip(scenario.people, median.people, strict=True):
        assert person.speed_mps <= max(2.0, space.levers["people.0.speed_mps"].range.high) + 1e-9
        if written.speed_mps < 1.8:
            assert person.speed_mps <= 2.0
        if written.backwards:
            assert person.speed_mps <= 1.2
        assert person.glances.notices_within_m > 0.0 or written.glances.notices_within_m == 0.0
        ways = [way_of(each.model_dump()) for each in (person, written)]
        found, was = (clearance_m(way, boxes) for way in ways)
        assert found >= min(was, RACK_CLEARANCE_M) - 1e-9


@settings(max_examples=40)
@given(name=st.sampled_from(_SCRIPTED), seed=st.integers(0, 2**32))
def test_scripted_workers_keep_to_human_limits(name, seed):
    space = _SPACES[name]
    (written,) = space.template.median().workers
    (worker,) = space.scenario(_values(space, seed)).workers
    speed, rate = peaks(worker.model_dump())
    most_speed, most_rate = peaks(written.model_dump())
    assert speed <= max(2.0, most_speed) + 1e-6
    assert rate <= max(3.0, most_rate) + 1e-6


def test_a_pause_of_a_script_delays_what_comes_after_it_and_nothing_before():
    space = _SPACES["crossing_attentive"]
    changed = {"workers.0.pace": 0.7, "workers.0.pause_at": 0.5, "workers.0.pause_s": 2.0}
    (written,) = space.template.median().workers
    (worker,) = space.scenario({**space.neutral, **changed}).workers
    begin, end = written.path[0].t_s, written.path[-1].t_s
    assert worker.path[0] == written.path[0]
    assert worker.path[-1].t_s == pytest.approx(begin + (end - begin) / 0.7 + 2.0)
    halt_s = begin + 0.5 * (end - begin) / 0.7
    here = [worker.motion(halt_s + late_s).position_odom_m for late_s in (0.0, 1.0, 2.0)]
    np.testing.assert_allclose(here, [here[0]] * 3, atol=1e-3)
    assert len(script_way(worker.model_dump())) == len(written.path) + 2


@pytest.mark.parametrize(
    ("name", "people", "message"), [("crossing_from_left", 0, "no people to vary")]
)
def test_a_scenario_without_people_is_refused(name, people, message):
    with pytest.raises(SimError, match=message):
        PeopleSpace(ScenarioTemplate.shipped(name), people)


def test_a_straight_way_is_shifted_to_its_left():
    way = np.array([[0.0, 0.0], [4.0, 0.0]])
    np.testing.assert_allclose(bent(way, 0.0, 0.0, 0.0), way)
    np.testing.assert_allclose(
        bent(way, 0.1, 0.5, -0.2), [[0.0, 0.1], [2.0, 0.5], [4.0, -0.2]], atol=1e-12
    )
    np.testing.assert_allclose(bent(way[:1], 0.3, 0.0, -0.2), [[0.3, -0.2]])


@given(turn=st.floats(0.0, 2.0 * math.pi), seed=st.integers(0, 2**32))
def test_bending_turns_with_the_world(turn, seed):
    rng = np.random.default_rng(seed)
    way, shifts = rng.uniform(-5.0, 5.0, (4, 2)), rng.uniform(-1.0, 1.0, 3).tolist()
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    np.testing.assert_allclose(
        bent(way @ rotation.T, *shifts), bent(way, *shifts) @ rotation.T, atol=1e-9
    )


def _record(**values) -> EpisodeRecord:
    return EpisodeRecord("s", 0, "p", "q", "truth", **values)


def test_scores_put_what_is_worse_below():
    ordered = [
        _record(robot_contacts=1, contact_speed_mps=1.2, min_margin_m=0.3),
        _record(robot_contacts=1, contact_speed_mps=0.1, min_margin_m=-2.0),
        _record(min_margin_m=-12.0),
        _record(min_margin_m=-0.5, person_contacts=1),
        _record(min_margin_m=0.5),
        _record(),
    ]
    scores = [score(record) for record in ordered]
    assert scores == sorted(scores)
    assert len(set(scores)) == len(scores)
    assert scores[1] <= CONTACT < scores[2]
    assert score(_record(error="died", robot_contacts=1)) == NOTHING == scores[-1]


@given(episodes=st.integers(1, 5000), scenarios=st.integers(1, 40), generation=st.integers(2, 40))
def test_a_search_has_at_least_the_episodes_asked_for_in_whole_generations(
    episodes, scenarios, generation
):
    settings = FalsifySettings("p", "", (), episodes, 1, "truth", "", 0, generation)
    if episodes < generation * scenarios:
        with pytest.raises(SimError, match="at least one generation"):
            _budget(settings, scenarios)
        return
    first, more, kept = _budget(settings, scenarios)
    total = first * scenarios + (more - first) * kept
    assert episodes <= total < episodes + generation * max(kept, 1)
    assert first % generation == more % generation == 0 < first <= more


_PLANTED = {"a": 0.83, "b": 0.12}
_PLANTED_SPACE = {name: Range(low=0.0, high=1.0) for name in _PLANTED}


def _planted_margin(values) -> float:
    """Two valleys: a wide one about the middle, and the deep one that is meant."""
    wide = sum((value - 0.5) ** 2 for value in values.values())
    deep = sum((values[name] - place) ** 2 for name, place in _PLANTED.items())
    return min(0.3 + wide, -1.0 + 4.0 * deep)


def _hunt(folder, calls=None) -> Hunt:
    def evaluate(batch):
        if calls is not None:
            calls.append(len(batch))
        return [Outcome((_planted_margin(values),), notes={"n": 1}) for values in batch]

    middle = dict.fromkeys(_PLANTED, 0.5)
    return Hunt("planted", _PLANTED_SPACE, middle, evaluate, folder, seed=0, generation=8)


@pytest.fixture(scope="module")
def hunted(tmp_path_factory):
    return _hunt(tmp_path_factory.mktemp("whole")).run(160)


def test_a_hunt_finds_a_planted_valley_and_begins_anew_when_it_finds_no_more(hunted):
    assert len(hunted) == 160
    best = min(hunted, key=lambda find: find.score)
    assert best.score < -0.99
    for name, place in _PLANTED.items():
        assert best.parameters[name] == pytest.approx(place, abs=0.05)
    assert len({find.round for find in hunted}) > 1


def test_a_hunt_goes_on_as_if_it_had_never_stopped(tmp_path, hunted):
    calls: list[int] = []
    _hunt(tmp_path).run(80)
    assert _hunt(tmp_path, calls).run(160) == hunted
    assert sum(calls) == 80


def test_worst_cases_of_one_scenario_differ(hunted):
    kept = worst_finds(hunted, {"planted": _PLANTED_SPACE}, 5)
    assert [find.score for find in kept] == sorted(find.score for find in kept)
    assert kept[0].score == min(find.score for find in hunted)
    for number, find in enumerate(kept):
        for other in kept[:number]:
            apart = [abs(find.parameters[n] - other.parameters[n]) for n in _PLANTED]
            assert max(apart) >= 0.2


_FALSIFY = ["falsify", "--scenario", "crossing_from_left", "--perception", "truth", "--worst", "2"]


@pytest.mark.slow
def test_a_floor_that_was_taken_away_is_found_and_the_worst_cases_replay(tmp_path, capsys):
    options = [*_FALSIFY, "--unsafe-no-floor", "--episodes", "12"]
    one, two = tmp_path / "one", tmp_path / "two"
    assert main([*options, "--out", str(one)]) == 1
    printed = capsys.readouterr()
    assert "UNSAFE" in printed.err
    assert "DOES NOT REPLAY" not in printed.out
    summary = json.loads((one / "summary.json").read_text())
    assert summary["robot_contacts"] > 0
    assert all(case["replays"] for case in summary["worst"])
    assert "UNSAFE" in (one / "worst_001.yaml").read_text()
    assert Scenario.from_yaml(one / "worst_001.yaml").name == "crossing_from_left_worst_001"
    assert main([*options, "--out", str(two), "--workers", "2"]) == 1
    for name in ("episodes.csv", "summary.json", "worst_001.yaml", "falsify.png"):
        assert (one / name).read_bytes() == (two / name).read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--episodes", "5"], "at least one generation of 12 a scenario"),
        (["--policy", "balancd"], "did you mean 'balanced'"),
        (["--resume"], "there is no falsification"),
        (["--planner", "nowhere"], "module:Class"),
    ],
)
def test_a_falsification_that_cannot_be_says_why_and_leaves_nothing(
    tmp_path, capsys, options, message
):
    out = tmp_path / "out"
    assert main([*_FALSIFY, "--out", str(out), *options]) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()
