"""The levers of a falsification: lapses, companions, exchanged ways and parked pallets."""

from __future__ import annotations

import json

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from awarenav.cli import main
from sim_tests.actors.behaviour import Hearing, Lapse
from sim_tests.scenario import ScenarioTemplate
from sim_tests.search.falsify import ScenarioSpace
from sim_tests.search.falsify._joint_parameters import (
    APART_M,
    COMPANION,
    PALLET_CLEARANCE_M,
    PALLET_LANE_CLEARANCE_M,
    PALLET_RADIUS_M,
)
from sim_tests.search.falsify._person_parameters import person_path

_NAMES = ("crossing_from_left", "blind_corner", "group_crossing", "head_on_in_aisle")
_SPACES = {name: ScenarioSpace(ScenarioTemplate.shipped(name)) for name in _NAMES}


def _scenario(name: str, **levers: float):
    """Return the scenario as written but for the levers; ``__`` stands for a dot."""
    space = _SPACES[name]
    values = {key.replace("__", "."): value for key, value in levers.items()}
    assert set(values) <= set(space.neutral)
    return space.scenario({**space.neutral, **values})


def _path(person) -> np.ndarray:
    return person_path(person.model_dump())


@pytest.mark.parametrize("name", _NAMES)
def test_at_their_neutral_values_the_levers_do_nothing(name):
    scenario = _scenario(name)
    written = _SPACES[name].template.median()
    assert scenario.layout == written.layout
    assert scenario.people == written.people
    assert all(person.lapse is None for person in scenario.people)


def test_a_lapse_has_the_searched_values():
    levers = {"people__0__lapse_after_s": 2.5, "people__0__lapse_halts": 0.7}
    (person,) = _scenario("crossing_from_left", **levers).people
    assert person.lapse == Lapse(after_look_s=2.5, looks_away=False, halts=True)
    away = {"people__0__lapse_after_s": 1.0, "people__0__lapse_looks_away": 0.6}
    (person,) = _scenario("crossing_from_left", **away).people
    assert person.lapse == Lapse(after_look_s=1.0, looks_away=True, halts=False)


def test_somebody_who_stands_in_the_scenario_sets_off():
    space = ScenarioSpace(ScenarioTemplate.shipped("standing_in_aisle"))
    levers = {"lapse_after_s": 2.0, "sets_off_x_m": -1.0, "sets_off_y_m": -1.5, "sets_off_mps": 1.8}
    values = {f"people.0.{key}": value for key, value in levers.items()}
    (written, *_), (person, *_) = (
        space.scenario({**space.neutral, **each}).people for each in ({}, values)
    )
    assert len(written.route) == 1
    np.testing.assert_allclose(_path(person)[1] - _path(person)[0], [-1.0, -1.5])
    assert person.speed_mps == 1.8
    assert person.lapse == Lapse(after_look_s=2.0, looks_away=False, halts=True)
    # Without a lapse nobody sets off.
    still = {**values, "people.0.lapse_after_s": 6.0}
    assert space.scenario({**space.neutral, **still}).people[0] == written


def test_a_companion_walks_beside_the_person_and_never_looks():
    written, companion = _scenario(
        "crossing_from_left", companion__kind=0.5, companion__aside_m=-0.9, companion__pace=1.1
    ).people
    assert companion.name == COMPANION
    assert companion.glances.notices_within_m == 0.0
    assert companion.speed_mps == pytest.approx(1.1 * written.speed_mps)
    line = shapely.LineString(_path(written))
    for point in _path(companion):
        assert line.distance(shapely.Point(point)) == pytest.approx(0.9, abs=0.05)
    box = _scenario("crossing_from_left", companion__kind=0.65).people[1]
    assert (companion.activity, box.activity) == ("none", "carry_box")


def test_a_companion_who_takes_over_begins_where_and_when_the_person_stops():
    levers = {"companion__kind": 1.0, "companion__from": 0.4, "companion__aside_m": 0.6}
    (written,) = _scenario("crossing_from_left").people
    person, companion = _scenario("crossing_from_left", **levers).people
    length = shapely.LineString(_path(written)).length
    assert shapely.LineString(_path(person)).length == pytest.approx(0.4 * length)
    assert np.hypot(*(_path(companion)[0] - _path(person)[-1])) == pytest.approx(0.6)
    np.testing.assert_allclose(_path(companion)[-1], _path(written)[-1])
    arrival_s = person.start_s + 0.4 * length / person.speed_mps
    assert companion.start_s == pytest.approx(arrival_s)


def test_two_people_exchange_their_ways():
    levers = {"exchange__happens": 1.0, "exchange__at": 0.5}
    before, after = (_scenario("group_crossing", **each).people for each in ({}, levers))
    for one, other in ((0, 1), (1, 0)):
        np.testing.assert_array_equal(_path(after[one])[0], _path(before[one])[0])
        np.testing.assert_array_equal(_path(after[one])[-1], _path(before[other])[-1])
    assert after[2:] == before[2:]


@settings(max_examples=60, deadline=None)
@given(name=st.sampled_from(_NAMES), seed=st.integers(0, 2**32))
def test_pallets_and_companions_are_in_nobodys_way(name, seed):
    space = _SPACES[name]
    rng = np.random.default_rng(seed)
    values = {key: rng.uniform(each.low, each.high) for key, each in space.ranges.items()}
    written, scenario = space.template.median(), space.scenario(values)
    starts = [_path(person)[0] for person in scenario.people]
    if scenario.people[-1].name == COMPANION:
        gaps = [np.hypot(*(each - starts[-1])) for each in starts[:-1]]
        assert min(gaps) >= APART_M - 1e-9
    if len(scenario.layout.props) == len(written.layout.props):
        return
    pallet = scenario.layout.props[-1]
    place, task = shapely.Point(pallet.x_m, pallet.y_m), scenario.robot
    way = shapely.LineString([(task.start_x_m, task.start_y_m), (task.goal_x_m, task.goal_y_m)])
    assert way.distance(place) >= PALLET_LANE_CLEARANCE_M - 1e-9
    for person in scenario.people:
        path = _path(person)
        line = shapely.LineString(path) if len(path) > 1 else shapely.Point(path[0])
        assert line.distance(place) >= PALLET_CLEARANCE_M - 1e-9
    for box in written.layout.obstacle_boxes_odom.tolist():
        assert shapely.box(*box).distance(place) >= PALLET_RADIUS_M - 1e-9


@pytest.mark.full
def test_the_search_runs_from_keypoints_and_scans(tmp_path):
    """The episodes are those of the perception asked for, and the file replays."""
    out = tmp_path / "out"
    status = main(
        "falsify --policy balanced --scenario crossing_from_left --episodes 2 --generation 2 "
        f"--perception keypoints --sensors camera+scanner --worst 1 --out {out}".split()
    )
    summary = json.loads((out / "summary.json").read_text())
    assert summary["episodes"] == 2
    assert status == (1 if summary["contacts"] else 0)
    assert json.loads((out / "falsify.json").read_text())["perception"] == "keypoints+scanner"
    case = (out / "worst_001.yaml").read_text()
    assert "--perception keypoints --sensors camera+scanner" in case
    assert "DOES NOT REPLAY" not in case


@pytest.mark.parametrize("name", ["crossing_from_left", "crossing_distracted"])
def test_how_people_answer_is_a_lever_where_the_robot_asks(name):
    """Neutral values change nothing; the others set one person's hearing alone."""
    template = ScenarioTemplate.shipped(name)
    space = ScenarioSpace(template, asks=True)
    kind = "people" if template.median().people else "workers"
    silent = ScenarioSpace(template)
    added = set(space.parameters) - set(silent.parameters)
    answers, delay, into = (
        f"{kind}.0.{key}" for key in ("answers", "answer_delay_s", "startles_into_path")
    )
    assert {answers, delay, into} <= added
    neutral = space.scenario(space.neutral)
    assert neutral == silent.scenario(silent.neutral)
    for values, changes in (
        ({answers: 0.1}, {"answers": 0.0}),
        ({answers: 0.9, delay: 1.5}, {"answers": 1.0, "delay_median_s": 1.5, "delay_spread": 1.0}),
        ({into: 0.8}, {"startles": 1.0, "startles_into_path": 1.0}),
    ):
        varied = space.scenario({**space.neutral, **values})
        first, *others = getattr(varied, kind)
        assert first.hearing == Hearing().with_numbers(changes)
        assert [each.hearing for each in others] == [None] * len(others)
        assert varied.hearing == Hearing()
    other = ScenarioSpace(template.with_population("phone_factor=0.2"), asks=True)
    (first, *_) = getattr(other.scenario({**other.neutral, into: 0.8}), kind)
    assert first.hearing.phone_factor == 0.2
