"""The variations of a falsification: what is varied, and within which limits."""

from __future__ import annotations

import math

import click
import numpy as np
import pytest
import shapely
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_tests import Scenario, SimError, run_crossing, shipped_scenarios
from sim_tests.actors.behaviour import FASTEST_RECORDED_MPS, Hearing, Lapse, draw_person
from sim_tests.actors.robot import NOVA_CARTER, RobotModel
from sim_tests.crossing.planner import StraightOn
from sim_tests.search.command import falsify
from sim_tests.search.falsify._parameters import (
    APART_M,
    COMPANION,
    PALLET_CLEARANCE_M,
    PALLET_LANE_CLEARANCE_M,
    PALLET_RADIUS_M,
    RACK_CLEARANCE_M,
    ROBOT_CLEARANCE_M,
    bent_path,
    clearance_m,
    person_path,
)
from sim_tests.search.falsify._scenario_space import ScenarioSpace

NAMES = (
    *("crossing_from_left", "runs_out", "blind_corner", "walking_backwards", "crowd_of_eight"),
    *("group_crossing", "head_on_in_aisle"),
)
SPACES = {name: ScenarioSpace(Scenario.shipped(name)) for name in (*NAMES, "paper_encounter")}


def recorded(name: str) -> ScenarioSpace:
    return ScenarioSpace(Scenario.shipped(name).with_population("recorded"))


def somewhere(space: ScenarioSpace, seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    return {name: rng.uniform(each.low, each.high) for name, each in space.ranges.items()}


def varied(space: ScenarioSpace | str, prefix: str = "", **levers: float):
    """Return the scenario as written but for some levers; ``__`` stands for a dot."""
    space = SPACES[space] if isinstance(space, str) else space
    values = {prefix + key.replace("__", "."): value for key, value in levers.items()}
    assert set(values) <= set(space.neutral)
    return space.scenario({**space.neutral, **values})


def path(person) -> np.ndarray:
    return person_path(person.model_dump())


def line(points) -> shapely.Geometry:
    return shapely.LineString(points) if len(points) > 1 else shapely.Point(points[0])


@pytest.mark.parametrize("name", SPACES)
def test_with_neutral_parameters_the_scenario_is_as_written(name):
    space = SPACES[name]
    written = space.written.model_copy(update={"start_jitter_s": 0.0})
    assert space.scenario(space.neutral) == written


@settings(max_examples=50)
@given(name=st.sampled_from(NAMES), seed=st.integers(0, 2**32))
def test_people_keep_to_human_limits_and_what_is_added_is_in_nobodys_way(name, seed):
    space = SPACES[name]
    median = space.written.model_copy(update={"start_jitter_s": 0.0})
    scenario = space.scenario(somewhere(space, seed))
    hall, task = scenario.layout, scenario.robot
    # At most one pallet is parked, and one companion added.
    props, people = median.layout.props, median.people
    assert hall.props[: len(props)] == props
    if all(key.startswith("people.") for key in space.written.distributions):
        assert hall.model_copy(update={"props": props}) == median.layout
        same = {"people": (), "layout": hall}
        assert scenario.model_copy(update=same) == median.model_copy(update=same)
    boxes = median.layout.obstacle_boxes_odom
    added = scenario.people[len(people) :]
    assert [person.name for person in added] in ([], [COMPANION])
    starts = [path(person)[0] for person in scenario.people]
    for person in added:
        assert person.speed_mps <= 2.0
        assert clearance_m(path(person), boxes) >= RACK_CLEARANCE_M - 1e-9
        gaps = [np.hypot(*(each - path(person)[0])) for each in starts[: len(people)]]
        assert min(gaps) >= APART_M - 1e-9
    for person, written in zip(scenario.people, people, strict=False):
        fastest = max(2.0, space.parameters["people.0.speed_mps"].range.high) + 1e-9
        assert person.speed_mps <= (2.0 if written.speed_mps < 1.8 else fastest)
        assert person.speed_mps <= 1.2 or not written.backwards
        assert person.glances.notices_within_m > 0.0 or written.glances.notices_within_m == 0.0
        found, was = (clearance_m(path(each), boxes) for each in (person, written))
        assert found >= min(was, RACK_CLEARANCE_M) - 1e-9
    for pallet in hall.props[len(props) :]:
        assert len(hall.props) == len(props) + 1
        place = shapely.Point(pallet.x_m, pallet.y_m)
        way = [(task.start_x_m, task.start_y_m), (task.goal_x_m, task.goal_y_m)]
        assert line(way).distance(place) >= PALLET_LANE_CLEARANCE_M - 1e-9
        for person in scenario.people:
            assert line(path(person)).distance(place) >= PALLET_CLEARANCE_M - 1e-9
        for box in boxes.tolist():
            assert shapely.box(*box).distance(place) >= PALLET_RADIUS_M - 1e-9


@pytest.mark.parametrize("name", ["crossing_distracted", "paper_encounter"])
def test_only_who_notices_the_robot_can_forget_it(name):
    unaware = ScenarioSpace(Scenario.shipped(name)).parameters
    assert "people.0.speed_mps" in unaware
    assert "people.0.lapse_after_s" not in unaware
    assert "people.0.lapse_after_s" in SPACES["crossing_from_left"].parameters


def test_a_lapse_has_the_searched_values():
    for levers, away, halts in (
        ({"lapse_halts": 0.7}, False, True),
        ({"lapse_looks_away": 0.6}, True, False),
    ):
        (person,) = varied("crossing_from_left", "people.0.", lapse_after_s=2.5, **levers).people
        assert person.lapse == Lapse(after_look_s=2.5, looks_away=away, halts=halts)


def test_somebody_who_stands_in_the_scenario_sets_off_at_a_lapse_alone():
    space = ScenarioSpace(Scenario.shipped("standing_in_aisle"))
    levers = {"sets_off_x_m": -1.0, "sets_off_y_m": -1.5, "sets_off_mps": 1.8}
    written, person, still = (
        varied(space, "people.0.", **each).people[0]
        for each in ({}, {**levers, "lapse_after_s": 2.0}, {**levers, "lapse_after_s": 6.0})
    )
    assert len(written.route) == 1
    np.testing.assert_allclose(path(person)[1] - path(person)[0], [-1.0, -1.5])
    assert person.speed_mps == 1.8
    assert person.lapse == Lapse(after_look_s=2.0, looks_away=False, halts=True)
    assert still == written


def test_a_companion_walks_beside_the_person_and_never_looks():
    levers = {"companion__aside_m": -0.9, "companion__pace": 1.1}
    written, companion = varied("crossing_from_left", companion__kind=0.5, **levers).people
    assert companion.name == COMPANION
    assert companion.glances.notices_within_m == 0.0
    assert companion.speed_mps == pytest.approx(1.1 * written.speed_mps)
    for point in path(companion):
        assert line(path(written)).distance(shapely.Point(point)) == pytest.approx(0.9, abs=0.05)
    box = varied("crossing_from_left", companion__kind=0.65).people[1]
    assert (companion.activity, box.activity) == ("none", "carry_box")


def test_a_companion_who_takes_over_begins_where_and_when_the_person_stops():
    levers = {"companion__kind": 1.0, "companion__from": 0.4, "companion__aside_m": 0.6}
    (written,) = varied("crossing_from_left").people
    person, companion = varied("crossing_from_left", **levers).people
    length = line(path(written)).length
    assert line(path(person)).length == pytest.approx(0.4 * length)
    assert np.hypot(*(path(companion)[0] - path(person)[-1])) == pytest.approx(0.6)
    np.testing.assert_allclose(path(companion)[-1], path(written)[-1])
    arrival_s = person.start_s + 0.4 * length / person.speed_mps
    assert companion.start_s == pytest.approx(arrival_s)


def test_two_people_exchange_their_ways():
    levers = {"exchange__happens": 1.0, "exchange__at": 0.5}
    before, after = (varied("group_crossing", **each).people for each in ({}, levers))
    for one, other in ((0, 1), (1, 0)):
        np.testing.assert_array_equal(path(after[one])[0], path(before[one])[0])
        np.testing.assert_array_equal(path(after[one])[-1], path(before[other])[-1])
    assert after[2:] == before[2:]


@pytest.mark.parametrize("name", ["crossing_from_left", "crossing_distracted"])
def test_how_people_answer_is_a_lever_where_the_robot_asks(name):
    """Neutral values change nothing; the others set one person's hearing alone."""
    scenario = Scenario.shipped(name)
    space, silent = ScenarioSpace(scenario, asks=True), ScenarioSpace(scenario)
    added = set(space.parameters) - set(silent.parameters)
    answers, delay, into = (
        f"people.0.{key}" for key in ("answers", "answer_delay_s", "startles_into_path")
    )
    assert {answers, delay, into} <= added
    assert space.scenario(space.neutral) == silent.scenario(silent.neutral)
    for values, changes in (
        ({answers: 0.1}, {"answers": 0.0}),
        ({answers: 0.9, delay: 1.5}, {"answers": 1.0, "delay_median_s": 1.5, "delay_spread": 1.0}),
        ({into: 0.8}, {"startles": 1.0, "startles_into_path": 1.0}),
    ):
        asked = space.scenario({**space.neutral, **values})
        first, *others = asked.people
        assert first.hearing == Hearing().model_copy(update=changes)
        assert [each.hearing for each in others] == [None] * len(others)
        assert asked.hearing == Hearing()
    other = ScenarioSpace(scenario.with_population("phone_factor=0.2"), asks=True)
    (first, *_) = other.scenario({**other.neutral, into: 0.8}).people
    assert first.hearing.phone_factor == 0.2


@pytest.mark.parametrize("name", shipped_scenarios("step_out"))
def test_of_people_who_step_out_the_robots_distance_is_a_lever_in_place_of_the_clock(name):
    space, moment = ScenarioSpace(Scenario.shipped(name)), "people.0.sets_off_within_m"
    assert "people.0.start_s" not in space.parameters
    assert "people.0.start_s" in SPACES["runs_out"].parameters
    assert space.parameters[moment].neutral == pytest.approx(1.2, abs=0.1)
    for metres in (0.3, 4.0):
        (person, *_) = space.scenario({**space.neutral, moment: metres}).people
        assert person.sets_off_within_m == pytest.approx(metres)
        assert person.start_s == 0.0


def test_the_search_takes_people_who_step_out_unless_others_are_named():
    (option,) = (each for each in falsify.params if each.name == "scenario")
    assert tuple(option.get_default(click.Context(falsify))) == ("all", "step_out")


def test_a_search_begins_at_the_medians_of_recorded_people():
    space = recorded("crossing_from_left")
    (written,), (person,) = space.written.people, varied(space).people
    drawn = [draw_person(written, np.random.default_rng(seed)) for seed in range(400)]
    speeds = np.array([each.speed_mps for each in drawn])
    assert np.ptp(speeds) > 0.5
    assert person.speed_mps == pytest.approx(np.median(speeds), abs=0.02)
    assert person.glances == drawn[0].glances != written.glances
    assert person.route == written.route
    assert person.as_written
    assert not written.as_written


def test_what_the_search_sets_is_not_drawn_again():
    space = recorded("intersection")
    levers = {"speed_mps": 2.4, "glance_median_s": 2.0, "looks": 0.5}
    (person,) = varied(space, "people.0.", **levers).people
    assert draw_person(person, np.random.default_rng(3)) is person
    assert (person.speed_mps, person.glances.glance_median_s) == (2.4, 2.0)
    assert person.glances.looker_share == 1.0
    assert space.ranges["people.0.speed_mps"].high == FASTEST_RECORDED_MPS
    classic = ScenarioSpace(Scenario.shipped("intersection")).ranges
    assert classic["people.0.speed_mps"].high == 2.0
    _, companion = varied(recorded("crossing_from_left"), companion__kind=0.5).people
    assert companion.as_written


def test_recorded_people_walk_at_the_speed_of_the_search():
    scenario = varied(recorded("crossing_from_left"), "people.0.", speed_mps=1.7)
    lasts = {"duration_s": scenario.people[0].start_s + 3.5}
    result = run_crossing(
        scenario.model_copy(update=lasts), policy="blind", planner=StraightOn(0.05), seed=5
    )
    places = np.array([frame.truth[0].position_odom_m for frame in result.frames])
    walked_m = np.hypot(*(places[-1] - places[-1 - 40]))  # the last two seconds
    assert walked_m / 2.0 == pytest.approx(1.7, abs=0.15)


def test_people_begin_farther_from_a_long_robot():
    model = RobotModel.shipped("forklift")
    longer_m = model.profile.circumscribed_radius_m - NOVA_CARTER.circumscribed_radius_m
    assert longer_m > 0.8
    data = yaml.safe_load(
        "{name: a, description: A person passes., duration_s: 3.0, robot: {goal_x_m: 3.0},"
        " layout: {x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0},"
        " people: [{name: worker, route: [{x_m: 0.0, y_m: 2.4}, {x_m: 4.0, y_m: 2.4}]}]}"
    )
    nearest = []
    for more in ({}, {"robot_model": "forklift"}):
        space = ScenarioSpace(Scenario.from_data({**data, **more}))
        people = [space.scenario(somewhere(space, seed)).people[0] for seed in range(25)]
        nearest.append(min(float(np.hypot(*path(person)[0])) for person in people))
    assert ROBOT_CLEARANCE_M <= nearest[0] < ROBOT_CLEARANCE_M + longer_m <= nearest[1] + 1e-9


def test_a_scenario_without_people_is_refused():
    with pytest.raises(SimError, match="no people to vary"):
        ScenarioSpace(Scenario.shipped("crossing_from_left"), 0)


def test_a_straight_path_is_shifted_to_its_left():
    points = np.array([[0.0, 0.0], [4.0, 0.0]])
    np.testing.assert_allclose(bent_path(points, 0.0, 0.0, 0.0), points)
    np.testing.assert_allclose(
        bent_path(points, 0.1, 0.5, -0.2), [[0.0, 0.1], [2.0, 0.5], [4.0, -0.2]], atol=1e-12
    )
    np.testing.assert_allclose(bent_path(points[:1], 0.3, 0.0, -0.2), [[0.3, -0.2]])


@given(turn=st.floats(0.0, 2.0 * math.pi), seed=st.integers(0, 2**32))
def test_bending_a_path_commutes_with_rotation(turn, seed):
    rng = np.random.default_rng(seed)
    points, shifts = rng.uniform(-5.0, 5.0, (4, 2)), rng.uniform(-1.0, 1.0, 3).tolist()
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    np.testing.assert_allclose(
        bent_path(points @ rotation.T, *shifts), bent_path(points, *shifts) @ rotation.T, atol=1e-9
    )
