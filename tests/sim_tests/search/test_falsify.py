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
from sim_tests.search import Outcome, Range
from sim_tests.search.falsify import (
    CONTACT_SCORE,
    NO_MARGIN_SCORE,
    Budget,
    RestartedSearch,
    ScenarioSpace,
    score,
    worst_trials,
)
from sim_tests.search.falsify._joint_parameters import COMPANION
from sim_tests.search.falsify._person_parameters import person_path
from sim_tests.search.falsify._script_parameters import peak_speed_and_acceleration, script_path
from sim_tests.search.falsify._variation import RACK_CLEARANCE_M, bent_path, clearance_m
from sim_tests.study.measures import EpisodeRecord

_NAMES = ("crossing_from_left", "runs_out", "blind_corner", "walking_backwards", "crowd_of_eight")
_SCRIPTED = ("crossing_attentive", "paper_encounter")
_SPACES = {name: ScenarioSpace(ScenarioTemplate.shipped(name)) for name in (*_NAMES, *_SCRIPTED)}


def _values(space: ScenarioSpace, seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    return {name: rng.uniform(each.low, each.high) for name, each in space.ranges.items()}


@pytest.mark.parametrize("name", _SPACES)
def test_with_neutral_parameters_the_scenario_is_as_written(name):
    space = _SPACES[name]
    written = space.template.median().model_copy(update={"start_jitter_s": 0.0})
    assert space.scenario(space.neutral) == written


@settings(max_examples=60)
@given(name=st.sampled_from(_NAMES), seed=st.integers(0, 2**32))
def test_people_keep_to_human_limits_and_outside_racks(name, seed):
    space = _SPACES[name]
    median = space.template.median()
    scenario = space.scenario(_values(space, seed))
    hall = scenario.layout
    # At most one pallet is parked, and one companion added.
    assert hall.props[: len(median.layout.props)] == median.layout.props
    assert len(hall.props) <= len(median.layout.props) + 1
    assert hall.model_copy(update={"props": median.layout.props}) == median.layout
    same = {"people": (), "layout": hall}
    assert scenario.model_copy(update=same) == median.model_copy(update=same)
    boxes = median.layout.obstacle_boxes_odom
    added = scenario.people[len(median.people) :]
    assert [person.name for person in added] in ([], [COMPANION])
    for person in added:
        assert person.speed_mps <= 2.0
        assert clearance_m(person_path(person.model_dump()), boxes) >= RACK_CLEARANCE_M - 1e-9
    for person, written in zip(scenario.people, median.people, strict=False):
        assert (
            person.speed_mps <= max(2.0, space.parameters["people.0.speed_mps"].range.high) + 1e-9
        )
        if written.speed_mps < 1.8:
            assert person.speed_mps <= 2.0
        if written.backwards:
            assert person.speed_mps <= 1.2
        assert person.glances.notices_within_m > 0.0 or written.glances.notices_within_m == 0.0
        paths = [person_path(each.model_dump()) for each in (person, written)]
        found, was = (clearance_m(path, boxes) for path in paths)
        assert found >= min(was, RACK_CLEARANCE_M) - 1e-9


@settings(max_examples=40)
@given(name=st.sampled_from(_SCRIPTED), seed=st.integers(0, 2**32))
def test_scripted_workers_keep_to_human_limits(name, seed):
    space = _SPACES[name]
    (written,) = space.template.median().workers
    (worker,) = space.scenario(_values(space, seed)).workers
    speed, rate = peak_speed_and_acceleration(worker.model_dump())
    most_speed, most_rate = peak_speed_and_acceleration(written.model_dump())
    assert speed <= max(2.0, most_speed) + 1e-6
    assert rate <= max(3.0, most_rate) + 1e-6


def test_a_pause_in_a_script_delays_everything_after_it_and_nothing_before():
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
    assert len(script_path(worker.model_dump())) == len(written.path) + 2


def test_a_scripted_worker_sets_off_after_the_end_of_the_script():
    space = _SPACES["crossing_attentive"]
    changed = {
        "workers.0.sets_off_after_s": 1.5,
        "workers.0.sets_off_x_m": -0.6,
        "workers.0.sets_off_y_m": -1.1,
        "workers.0.sets_off_mps": 1.8,
    }
    (written,) = space.template.median().workers
    (worker,) = space.scenario({**space.neutral, **changed}).workers
    end = written.path[-1]
    assert worker.path[: len(written.path)] == written.path
    for late_s in (0.0, 0.7, 1.5):
        here = worker.motion(end.t_s + late_s).position_odom_m
        np.testing.assert_allclose(here, [end.x_m, end.y_m], atol=1e-3)
    after = worker.motion(end.t_s + 1.5 + 5.0).position_odom_m
    np.testing.assert_allclose(after, [end.x_m - 0.6, end.y_m - 1.1], atol=1e-3)
    # As fast as was asked for, but no faster than people accelerate.
    times = np.arange(end.t_s + 1.5, end.t_s + 6.5, 0.01)
    walked = np.array([worker.motion(t).position_odom_m for t in times.tolist()])
    speeds = np.linalg.norm(np.diff(walked, axis=0), axis=1) / 0.01
    length_m = math.hypot(0.6, 1.1)
    lasts_s = max(1.5 * length_m / 1.8, math.sqrt(6.0 * length_m / 3.0) + 0.02)
    assert speeds.max() == pytest.approx(1.5 * length_m / lasts_s, rel=0.01)
    # The body turns to where it walks.
    heading = worker.motion(times[0] + 0.6).heading_odom_rad
    assert math.remainder(heading - math.atan2(-1.1, -0.6), math.tau) == pytest.approx(0.0, abs=0.1)


def test_a_scripted_worker_forgets_the_robot_at_a_time():
    space = _SPACES["crossing_attentive"]
    changed = {"workers.0.looks_away_after_s": 3.0, "workers.0.away_yaw_deg": -60.0}
    (worker,) = space.scenario({**space.neutral, **changed}).workers
    begin = worker.path[0].t_s
    for t_s, azimuth in ((0.0, 0.3), (2.9, 0.3), (3.4, -math.pi / 3), (20.0, -math.pi / 3)):
        looks = worker.gaze_angles(begin + t_s, 0.0, (0.3, -0.1))
        assert looks[0] == pytest.approx(azimuth), t_s
    at_once = {**changed, "workers.0.looks_away_after_s": 0.0}
    (worker,) = space.scenario({**space.neutral, **at_once}).workers
    assert worker.gaze_angles(begin, 0.0, (0.3, -0.1))[0] == pytest.approx(-math.pi / 3)


def test_only_who_looks_at_the_robot_can_forget_it():
    unaware = ScenarioSpace(ScenarioTemplate.shipped("crossing_distracted")).parameters
    assert "workers.0.sets_off_after_s" in unaware
    assert "workers.0.looks_away_after_s" not in unaware
    for name in _NAMES:
        assert not [key for key in _SPACES[name].parameters if key.startswith("workers.")]


@pytest.mark.parametrize(
    ("name", "people", "message"), [("crossing_from_left", 0, "no people to vary")]
)
def test_a_scenario_without_people_is_refused(name, people, message):
    with pytest.raises(SimError, match=message):
        ScenarioSpace(ScenarioTemplate.shipped(name), people)


def test_a_straight_path_is_shifted_to_its_left():
    path = np.array([[0.0, 0.0], [4.0, 0.0]])
    np.testing.assert_allclose(bent_path(path, 0.0, 0.0, 0.0), path)
    np.testing.assert_allclose(
        bent_path(path, 0.1, 0.5, -0.2), [[0.0, 0.1], [2.0, 0.5], [4.0, -0.2]], atol=1e-12
    )
    np.testing.assert_allclose(bent_path(path[:1], 0.3, 0.0, -0.2), [[0.3, -0.2]])


@given(turn=st.floats(0.0, 2.0 * math.pi), seed=st.integers(0, 2**32))
def test_bending_a_path_commutes_with_rotation(turn, seed):
    rng = np.random.default_rng(seed)
    path, shifts = rng.uniform(-5.0, 5.0, (4, 2)), rng.uniform(-1.0, 1.0, 3).tolist()
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    np.testing.assert_allclose(
        bent_path(path @ rotation.T, *shifts), bent_path(path, *shifts) @ rotation.T, atol=1e-9
    )


def _record(**values) -> EpisodeRecord:
    return EpisodeRecord("s", 0, "p", "q", "truth", **values)


def _touched(speed_mps):
    """The figures of a contact with a moving robot of a person who had not looked."""
    return {
        **dict.fromkeys(("moving_contacts", "moving_contacts_unaware"), 1),
        **dict.fromkeys(("moving_contact_mps", "moving_contact_unaware_mps"), speed_mps),
    }


def test_worse_episodes_have_lower_scores():
    ordered = [
        _record(**_touched(1.2), min_margin_unaware_m=0.3),
        _record(**_touched(0.1), min_margin_unaware_m=-2.0),
        _record(min_margin_unaware_m=-12.0),
        # Somebody who had looked was touched: the margin counts.
        _record(
            min_margin_unaware_m=-1.0, robot_contacts=1, moving_contacts=1, moving_contact_mps=1.4
        ),
        _record(min_margin_unaware_m=-0.5, person_contacts=1),
        _record(min_margin_unaware_m=0.5),
        _record(),
    ]
    scores = [score(record) for record in ordered]
    assert scores == sorted(scores)
    assert len(set(scores)) == len(scores)
    assert scores[1] <= CONTACT_SCORE < scores[2]
    assert score(_record(error="died", **_touched(1.0))) == NO_MARGIN_SCORE == scores[-1]
    # Without its floor, a robot must keep clear of everybody.
    assert score(ordered[3], everybody=True) == CONTACT_SCORE - 1.4


@given(episodes=st.integers(1, 5000), scenarios=st.integers(1, 40), generation=st.integers(2, 40))
def test_a_budget_has_at_least_the_given_episodes_in_whole_generations(
    episodes, scenarios, generation
):
    if episodes < generation * scenarios:
        with pytest.raises(SimError, match="at least one generation"):
            Budget.of(episodes, scenarios, generation)
        return
    budget = Budget.of(episodes, scenarios, generation)
    total = budget.total(scenarios)
    assert episodes <= total < episodes + generation * max(budget.worst, 1)
    assert budget.first % generation == budget.total_if_worst % generation == 0
    assert 0 < budget.first <= budget.total_if_worst


_PLANTED = {"a": 0.83, "b": 0.12}
_PLANTED_SPACE = {name: Range(low=0.0, high=1.0) for name in _PLANTED}


def _planted_margin(values) -> float:
    """A wide valley about the middle, and the deep valley that the search must find."""
    wide = sum((value - 0.5) ** 2 for value in values.values())
    deep = sum((values[name] - place) ** 2 for name, place in _PLANTED.items())
    return min(0.3 + wide, -1.0 + 4.0 * deep)


def _search(folder, calls=None) -> RestartedSearch:
    def evaluate(batch):
        if calls is not None:
            calls.append(len(batch))
        return [Outcome((_planted_margin(values),), notes={"n": 1}) for values in batch]

    middle = dict.fromkeys(_PLANTED, 0.5)
    return RestartedSearch(
        "planted", _PLANTED_SPACE, middle, evaluate, folder, seed=1, generation=6
    )


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    return _search(tmp_path_factory.mktemp("whole")).run(72)


def test_a_search_finds_the_deep_valley_and_restarts_without_progress(searched):
    assert len(searched) == 72
    best = min(searched, key=lambda trial: trial.score)
    assert best.score < -0.99
    for name, place in _PLANTED.items():
        assert best.parameters[name] == pytest.approx(place, abs=0.05)
    assert len({trial.round for trial in searched}) > 1


def test_a_continued_search_equals_an_uninterrupted_one(tmp_path, searched):
    calls: list[int] = []
    _search(tmp_path).run(36)
    assert _search(tmp_path, calls).run(72) == searched
    assert sum(calls) == 36


def test_worst_cases_of_one_scenario_differ(searched):
    worst = worst_trials(searched, {"planted": _PLANTED_SPACE}, 5)
    assert [trial.score for trial in worst] == sorted(trial.score for trial in worst)
    assert worst[0].score == min(trial.score for trial in searched)
    for number, trial in enumerate(worst):
        for other in worst[:number]:
            apart = [abs(trial.parameters[n] - other.parameters[n]) for n in _PLANTED]
            assert max(apart) >= 0.2


# A person whom a robot without its floor hits.
_SCENARIO = """
name: crosses_ahead
description: A person crosses the robot's way and does not look.
duration_s: 3.0
control_hz: 10.0
layout: {x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0}
robot: {goal_x_m: 3.0}
workers:
  - path:
      - {t_s: 0.0, x_m: 1.8, y_m: -1.2}
      - {t_s: 3.5, x_m: 1.8, y_m: 1.2}
"""
_FALSIFY = ["falsify", "--perception", "truth", "--worst", "2"]


@pytest.mark.slow
def test_a_removed_floor_is_found_and_the_worst_cases_replay(tmp_path, capsys):
    scenario = tmp_path / "crosses_ahead.yaml"
    scenario.write_text(_SCENARIO)
    options = [*_FALSIFY, "--scenario", str(scenario), "--episodes", "4", "--generation", "4"]
    options += ["--unsafe-no-floor"]
    one, two = tmp_path / "one", tmp_path / "two"
    assert main([*options, "--out", str(one)]) == 1
    printed = capsys.readouterr()
    assert "UNSAFE" in printed.err
    assert "DOES NOT REPLAY" not in printed.out
    summary = json.loads((one / "summary.json").read_text())
    assert summary["contacts"] > 0
    assert all(case["replays"] for case in summary["worst"])
    assert "UNSAFE" in (one / "worst_001.yaml").read_text()
    assert Scenario.from_yaml(one / "worst_001.yaml").name == "crosses_ahead_worst_001"
    assert main([*options, "--out", str(two), "--workers", "2"]) == 1
    for name in ("episodes.csv", "summary.json", "worst_001.yaml", "falsify.png"):
        assert (one / name).read_bytes() == (two / name).read_bytes()


@pytest.mark.slow
def test_a_falsification_goes_on_with_more_episodes(tmp_path, capsys):
    scenario = tmp_path / "crosses_ahead.yaml"
    scenario.write_text(_SCENARIO)
    options = [*_FALSIFY, "--scenario", str(scenario), "--generation", "2"]
    grown, whole = tmp_path / "grown", tmp_path / "whole"
    main([*options, "--episodes", "2", "--out", str(grown)])
    main([*options, "--episodes", "4", "--out", str(grown), "--resume"])
    main([*options, "--episodes", "4", "--out", str(whole)])
    for name in ("falsify.json", "episodes.csv", "summary.json", "worst_001.yaml"):
        assert (grown / name).read_bytes() == (whole / name).read_bytes()
    capsys.readouterr()
    assert main([*options, "--episodes", "2", "--out", str(grown), "--resume"]) == 2
    assert "another episodes: 4, now 2" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--episodes", "5"], "at least one generation of 12 per scenario"),
        (["--policy", "balancd"], "did you mean 'balanced'"),
        (["--against", "blnd"], "did you mean 'blind'"),
        (["--resume"], "there is no falsification"),
        (["--planner", "nowhere"], "module:Class"),
    ],
)
def test_an_impossible_falsification_is_refused_with_a_reason_and_leaves_nothing(
    tmp_path, capsys, options, message
):
    out = tmp_path / "out"
    arguments = [*_FALSIFY, "--scenario", "crossing_from_left", "--out", str(out)]
    assert main([*arguments, *options]) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()
