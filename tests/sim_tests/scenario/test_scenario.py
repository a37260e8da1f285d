import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from sim_tests import Scenario, SimError, run_crossing, shipped_scenarios
from sim_tests.scenario import read_distribution

BASE = {
    "name": "mine",
    "duration_s": 20.0,
    "layout": "crossing",
    "robot": {"goal_x_m": 11.0},
    "people": [
        {
            "name": "worker",
            "route": [{"x_m": 6.0, "y_m": {"uniform": {"low": 5.0, "high": 6.0}}}, [6.0, -6.0]],
            "speed_mps": {"normal": {"mean": 1.3, "std": 0.2, "low": 0.9, "high": 1.5}},
            "start_s": {"uniform": {"low": 0.0, "high": 2.0}},
        }
    ],
}
BASE["people"][0]["route"][1] = {"x_m": 6.0, "y_m": -6.0}

shares = st.floats(0.0, 1.0)
limits = st.tuples(st.floats(-50.0, 50.0), st.floats(0.1, 20.0)).map(
    lambda pair: {"low": pair[0], "high": pair[0] + pair[1]}
)


def varied(**changes):
    data = copy.deepcopy(BASE)
    data["people"][0].update(changes)
    return Scenario.from_data(data)


@given(limits, shares, shares)
def test_quantiles_stay_within_bounds_and_rise(ends, one, other):
    middle = 0.5 * (ends["low"] + ends["high"])
    for distribution in (
        read_distribution("x", "uniform", ends),
        read_distribution("x", "normal", {**ends, "mean": middle, "std": 1.0}),
        read_distribution("x", "choice", [ends["high"], ends["low"]]),
        read_distribution("x", "integers", {"low": -3, "high": 8}),
        read_distribution("x", "lognormal", {"median": 0.83, "quartiles": [0.47, 1.5]}),
    ):
        low, high = distribution.bounds
        first, second = (distribution.quantile(share) for share in sorted((one, other)))
        assert low <= first <= second <= high


def test_draws_follow_the_named_distribution():
    share = (np.arange(4000) + 0.5) / 4000
    normal = read_distribution("x", "normal", {"mean": 1.3, "std": 0.2, "low": 0.9, "high": 1.5})
    expected = stats.truncnorm((0.9 - 1.3) / 0.2, (1.5 - 1.3) / 0.2, 1.3, 0.2)
    drawn = np.array([normal.quantile(each) for each in share])
    np.testing.assert_allclose(drawn, expected.ppf(share), atol=1e-9)

    # Duration of a glance at a vehicle: its quartiles are reproduced.
    glance = read_distribution(
        "x", "lognormal", {"median": 0.83, "quartiles": [0.47, 1.5], "low": 1e-3, "high": 1e3}
    )
    spread = np.log(1.5 / 0.47) / 2.0
    quartiles = [glance.quantile(each) for each in (0.25, 0.5, 0.75)]
    np.testing.assert_allclose(np.log(quartiles), np.log(0.83) + spread * np.array([-1, 0, 1]))

    integers = read_distribution("x", "integers", {"low": 2, "high": 5})
    values, counts = np.unique([integers.quantile(each) for each in share], return_counts=True)
    assert values.tolist() == [2, 3, 4, 5]
    assert set(counts.tolist()) == {1000}


def test_parameters_lists_the_distributions_by_path():
    paths = varied().distributions
    assert list(paths) == ["people.0.route.0.y_m", "people.0.speed_mps", "people.0.start_s"]
    assert paths["people.0.start_s"].bounds == (0.0, 2.0)


def test_the_same_seed_draws_the_same_scenario():
    first = varied().draw(3)
    assert first == varied().draw(3)
    assert first != varied().draw(4)
    assert first.draw(4) is first


def test_adding_or_reordering_parameters_changes_no_other_draw():
    plain = varied().draw(7).people[0]
    fewer = varied(start_s=1.0).draw(7).people[0]
    assert (fewer.speed_mps, fewer.route) == (plain.speed_mps, plain.route)
    more = varied(stature_m={"uniform": {"low": 1.6, "high": 1.9}}).draw(7).people[0]
    assert (more.speed_mps, more.start_s, more.route) == (
        plain.speed_mps,
        plain.start_s,
        plain.route,
    )
    data = copy.deepcopy(BASE)
    data["people"][0] = dict(reversed(data["people"][0].items()))
    assert Scenario.from_data(data).draw(7).people[0] == plain


def test_draws_of_many_seeds_are_uniform_and_uncorrelated():
    drawn = np.array(
        [
            (person.start_s / 2.0, person.route[0].y_m - 5.0)
            for person in (varied().draw(seed).people[0] for seed in range(400))
        ]
    )
    for column in drawn.T:
        assert stats.kstest(column, "uniform").pvalue > 0.01
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 0.15


def test_given_values_replace_draws_and_the_others_are_medians():
    person = varied().with_values({"people.0.speed_mps": 1.0}).people[0]
    assert person.speed_mps == 1.0
    assert person.start_s == 1.0
    assert person.route[0].y_m == 5.5
    with pytest.raises(SimError, match=r"did you mean 'people\.0\.speed_mps'"):
        varied().with_values({"people.0.speed": 1.0})
    with pytest.raises(SimError, match=r"people\.0\.speed_mps.*greater than 0"):
        varied().with_values({"people.0.speed_mps": -1.0})
    with pytest.raises(SimError, match="finite"):
        varied().with_values({"people.0.start_s": float("nan")})


@pytest.mark.parametrize("name", shipped_scenarios())
def test_shipped_scenarios_round_trip_through_text_and_pickle(name):
    shipped = Scenario.shipped(name)
    assert shipped.name == name
    assert Scenario.from_text(shipped.to_text()) == shipped
    assert pickle.loads(pickle.dumps(shipped)) == shipped
    drawn = shipped.draw(5)
    again = Scenario.from_text(drawn.to_text())
    assert not again.distributions
    assert again.draw(99) == drawn


def test_a_file_extends_shared_defaults_and_finds_its_recording_in_its_folder(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "name: mine\nextends: crossing_hall\nreplay_csv: people.csv\nrobot: {start_x_m: -1.0}\n"
    )
    mine = Scenario.from_yaml(path)
    hall = Scenario.shipped("crossing_attentive")
    assert (mine.layout, mine.camera) == (hall.layout, hall.camera)
    assert (mine.robot.start_x_m, mine.robot.goal_x_m) == (-1.0, hall.robot.goal_x_m)
    assert mine.replay_csv == str(tmp_path / "people.csv")
    assert Scenario.from_yaml(path) == mine
    empty = mine.without_people()
    assert (empty.people, empty.replay_csv) == ((), None)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed_mps": {"unifrom": {"low": 1, "high": 2}}}, "did you mean 'uniform'"),
        ({"speed_mps": {"uniform": {"low": 2, "high": 1}}}, r"people\.0\.speed_mps: uniform: low"),
        ({"speed_mps": {"uniform": {"low": 1, "hihg": 2}}}, "did you mean 'high'"),
        ({"speed_mps": {"uniform": [1, 2]}}, r"people\.0\.speed_mps: uniform must be a mapping"),
        ({"speed_mps": {"choice": 3}}, "choice must be a list of numbers"),
        ({"speed_mps": {"choice": []}}, r"people\.0\.speed_mps: choice"),
        ({"speed_mps": {"choice": ["fast"]}}, r"people\.0\.speed_mps: choice"),
        (
            {"speed_mps": {"normal": {"mean": 3, "std": 0.1, "low": 1, "high": 2}}},
            "mean must lie from low 1 to high 2, got 3",
        ),
        ({"speed_mps": {"lognormal": {"median": 1, "quartiles": [1.2, 2]}}}, "quartiles must"),
        ({"speed_mps": {"uniform": {"low": 1, "high": 2}, "unit": "m/s"}}, "must be the only key"),
        ({"spede_mps": 1.0}, "did you mean 'speed_mps'"),
        ({"speed_mps": "fast"}, r"people\.0\.speed_mps.*got 'fast'"),
        ({"name": {"choice": [1, 2]}}, r"people\.0\.name"),
        ({"look.coat": {"choice": [1, 2]}}, r"unknown key in 'people\.0\.look\.coat'"),
        (
            {"speed_mps": {"uniform": {"low": {"uniform": {"low": 1, "high": 2}}, "high": 3}}},
            r"speed_mps: uniform: low: must be a number, got uniform",
        ),
    ],
)
def test_impossible_values_are_refused_by_path(change, message):
    with pytest.raises(SimError, match=message):
        varied(**change)


@pytest.mark.parametrize("robot", [3, ["forklift"], {"unknown": 1}])
def test_what_is_no_robot_is_refused_by_its_key(robot):
    with pytest.raises(SimError, match="scenario: for_robot: "):
        Scenario.from_data({**BASE, "for_robot": robot})


@pytest.mark.parametrize("seed", [-1, 1.5, None, [1, 2], True])
def test_what_is_no_seed_draws_nothing(seed):
    with pytest.raises(SimError, match="seed must be"):
        varied().draw(seed)


def test_a_seed_may_be_of_any_integer_type_and_length():
    scenario = varied(speed_mps={"uniform": {"low": 1, "high": 2}})
    assert scenario.draw(np.int64(3)) == scenario.draw(3)
    assert scenario.draw(10**40) == scenario.draw(10**40) != scenario.draw(10**40 + 1)


def test_a_draw_that_is_not_valid_names_its_seed():
    """The lowest of three choices is drawn by the seeds that draw the first of other three."""
    valid, refused = (varied(speed_mps={"choice": [low, 1, 1.2]}) for low in (0.5, -1))
    seed = next(seed for seed in range(20) if valid.draw(seed).people[0].speed_mps == 0.5)
    with pytest.raises(SimError, match=rf"mine, seed {seed}: people\.0\.speed_mps: .* got -1"):
        refused.draw(seed)


def test_people_may_be_a_tuple():
    people = ({**BASE["people"][0], "speed_mps": {"uniform": {"low": 1, "high": 2}}},)
    listed = {**BASE, "people": list(people)}
    assert Scenario.from_data({**BASE, "people": people}).draw(1) == Scenario.from_data(
        listed
    ).draw(1)


def test_only_numbers_of_people_and_robot_may_be_distributions():
    with pytest.raises(SimError, match="duration_s: only numbers under people, robot"):
        Scenario.from_data({**BASE, "duration_s": {"uniform": {"low": 10, "high": 20}}})
    varied = {**BASE, "robot": {"goal_x_m": {"choice": [10.0, 12.0]}}}
    assert {Scenario.from_data(varied).draw(seed).robot.goal_x_m for seed in range(9)} == {10, 12}


def test_two_people_with_the_same_name_are_refused():
    twins = {**BASE, "people": BASE["people"] * 2}
    with pytest.raises(SimError, match="must be unique, got worker twice"):
        Scenario.from_data(twins)


def test_files_that_are_not_scenarios_are_refused_by_name(tmp_path):
    with pytest.raises(SimError, match=r"cannot read .*none\.yaml"):
        Scenario.from_yaml(tmp_path / "none.yaml")
    for text, message in (
        ("a: [", r"mine\.yaml is not valid YAML"),
        ("- a", r"mine\.yaml must hold lines of `key: value`, got a list"),
        ("name: a\nextends: crossing_hal", "did you mean 'crossing_hall'"),
        ("name: a\nduration_s: 5\nrobot: {goal_x_m: 3, gaol_y_m: 1}\n", "mean 'goal_y_m'"),
        ("name: a\nduration_s: 5\nlayout: maze\nrobot: {goal_x_m: 3}\n", "'crossing', 'open'"),
        ("name: a\nduration_s: -5\nrobot: {goal_x_m: 3}\n", "duration_s"),
    ):
        (tmp_path / "mine.yaml").write_text(text)
        with pytest.raises(SimError, match=message):
            Scenario.from_yaml(tmp_path / "mine.yaml")


def test_a_name_may_ask_for_a_version():
    assert Scenario.shipped("crossing_from_left@1").id == "crossing_from_left@1"
    with pytest.raises(SimError, match="has version 1, got 'crossing_from_left@2'"):
        Scenario.shipped("crossing_from_left@2")


def test_attentive_and_distracted_differ_only_in_the_gaze():
    first, second = (Scenario.shipped(f"crossing_{who}") for who in ("attentive", "distracted"))
    same = {"name": "", "description": "", "attention": "mixed", "people": ()}
    assert first.model_copy(update=same) == second.model_copy(update=same)
    (one,), (other,) = first.people, second.people
    assert one.model_copy(update={"glances": other.glances}) == other
    assert one.glances.watches
    assert other.glances.notices_within_m == 0.0


def test_a_crossing_is_drawn_by_its_seed():
    def first(scenario):
        seen = []

        def look(frame, _):
            seen.append(frame)
            raise StopIteration

        with pytest.raises(StopIteration):
            run_crossing(scenario, policy="assertive", seed=2, observer=look)
        return seen[0]

    written = Scenario.shipped("standing_in_aisle")
    drawn = written.draw(2)
    place = [drawn.people[0].route[0].x_m, drawn.people[0].route[0].y_m]
    for scenario in ("standing_in_aisle", written, drawn):
        frame = first(scenario)
        assert frame.truth[0].position_odom_m == pytest.approx(place)
        start_m = frame.robot_state.position_odom_m[0]
        assert start_m == pytest.approx(drawn.robot.start_x_m, abs=1e-9)


def test_a_copy_with_other_values_keeps_the_medians():
    written = varied()
    copied = written.model_copy(update={"duration_s": 5.0})
    assert copied.draw(3) is copied
    assert copied.people == written.people
    assert copied.model_copy(update={"duration_s": 20.0}) == written.with_values({}) != written
