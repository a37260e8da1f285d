"""Measures that others use: equal to computations from their definitions, and to known values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from social_reference import reference_measures
from social_scenes import formula_episode, random_episode, straight

from sim_tests import SimError
from sim_tests.study.social import SOCIAL_MEASURES, Outcome, social_measures

T_S = np.arange(0.0, 10.0, 0.1)


@pytest.mark.parametrize("seed", range(12))
def test_every_measure_equals_the_computation_from_its_definition(seed):
    episode = random_episode(seed)
    ours, theirs = social_measures(episode), reference_measures(episode, [(0, 1)])
    assert set(ours) == set(theirs) == set(SOCIAL_MEASURES)
    for name, value in theirs.items():
        assert ours[name] == pytest.approx(value, rel=1e-6, abs=1e-6), name


def test_the_random_episodes_reach_every_branch():
    """Parity would prove little if nobody came near and nothing differed."""
    found = [social_measures(random_episode(seed)) for seed in range(12)]
    for name in SOCIAL_MEASURES:
        values = {each[name] for each in found}
        assert len(values - {None}) > 1 or name in ("human_delay_s", "stl"), name
    assert {each["time_to_collision_s"] == 0.0 for each in found} == {True, False}


def test_without_people_their_measures_do_not_apply():
    measured = social_measures(random_episode(1, people=0))
    ours = random_episode(1, people=0)
    for name in ("time_to_collision_s", "intimate_s", "hunav_social_work_mps2", "people_jerk_mps3"):
        assert measured[name] is None
    assert measured["hunav_path_length_m"] > 0.0
    assert measured["hunav_obstacle_force_mps2"] > 0.0
    assert ours.groups == ()


@settings(max_examples=25)
@given(st.booleans(), st.floats(1.0, 50.0), st.floats(1.0, 50.0), st.floats(1.0, 50.0))
def test_spl_and_stl_are_shares_that_only_the_reference_reaches(success, length, best, time):
    outcome = Outcome(success, time, best, best)
    episode = formula_episode(
        [0.0, 1.0], straight(length), goal_m=np.array([length, 0.0]), outcome=outcome
    )
    measured = social_measures(episode)
    for name, actual in (("spl", length), ("stl", time)):
        assert 0.0 <= measured[name] <= 1.0
        assert (measured[name] == 1.0) == (success and actual <= best)


def test_a_full_circle_turns_by_two_pi():
    def circle(t):
        return math.sin(t), 1.0 - math.cos(t), t, 1.0

    times = np.linspace(0.0, math.tau, 400)
    measured = social_measures(formula_episode(times, circle, goal_m=np.array([5.0, 0.0])))
    assert measured["hunav_heading_changes_rad"] == pytest.approx(math.tau)
    assert measured["path_irregularity_rad"] == pytest.approx(math.tau)  # the goal lies ahead
    assert measured["path_irregularity_radpm"] == pytest.approx(1.0, rel=1e-4)  # 1 / radius


@settings(max_examples=25)
@given(st.floats(0.2, 2.0), st.floats(0.0, 2.0), st.floats(4.0, 9.0))
def test_head_on_discs_meet_when_their_gap_is_closed(robot, person, apart):
    walker = straight(person, (apart, 0.0), math.pi)
    measured = social_measures(formula_episode([0.0], straight(robot), [walker]))
    expected = (apart - 0.6) / (robot + person)
    assert measured["time_to_collision_s"] == pytest.approx(expected, rel=1e-9)


def test_zones_follow_the_nearest_surface_and_the_times_add_up():
    """A robot at 1 m/s drives at a person who stands 5.6 m ahead; the discs have 0.6 m together."""
    times = np.arange(0.0, 5.01, 0.01)
    measured = social_measures(formula_episode(times, straight(1.0), [straight(0.0, (5.6, 0.0))]))
    assert measured["social_s"] == pytest.approx(2.4, abs=0.011)  # from 3.6 to 1.2 m
    assert measured["personal_s"] == pytest.approx(0.75, abs=0.011)
    assert measured["intimate_s"] == pytest.approx(0.45, abs=0.011)
    assert measured["hunav_min_distance_m"] == pytest.approx(0.0, abs=1e-9)
    assert measured["navwareset_min_distance_m"] == pytest.approx(0.6)
    # Centre distances of 0.9 m and more, of 5.6 down to 0.6.
    assert measured["navwareset_compliance_percent"] == pytest.approx(94.0, abs=0.5)
    assert measured["navwareset_psc_percent"] == 0.0


def test_a_robot_between_two_people_who_face_each_other_stands_in_their_group():
    facing = [straight(0.0, (-0.7, 1.0), 0.0), straight(0.0, (0.7, 1.0), math.pi)]
    at = formula_episode(T_S, straight(0.0, (0.0, 1.0)), facing)
    assert at.groups == ((0, 1),)
    assert social_measures(at)["hunav_group_intimate_percent"] == 100.0
    aside = formula_episode(T_S, straight(0.0, (0.0, -0.5)), facing)
    assert social_measures(aside)["hunav_group_social_percent"] == 100.0  # 1.5 − 0.3 m


def test_a_steady_acceleration_is_its_own_mean_and_has_no_jerk():
    measured = social_measures(
        formula_episode(T_S, lambda t: (0.25 * t * t, 0.0, 0.0, 0.5 * t), goal_m=None)
    )
    assert measured["navwareset_acceleration_mps2"] == pytest.approx(0.5)
    assert measured["navwareset_jerk_mps3"] == pytest.approx(0.0, abs=1e-9)
    assert measured["socnavgym_avg_acceleration_mps2"] == pytest.approx(0.5)
    # HuNavSim divides the sum over N − 1 steps by N.
    assert measured["hunav_acceleration_mps2"] == pytest.approx(0.5 * 99 / 100)
    assert measured["path_irregularity_rad"] is None


@settings(max_examples=8)
@given(st.integers(0, 1000), st.floats(-3.0, 3.0), st.floats(-50.0, 50.0))
def test_no_measure_depends_on_the_frame(seed, angle, shift):
    """Rotating and shifting the world changes nothing."""
    episode = random_episode(seed, count=25)
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.array([[cos, sin], [-sin, cos]])
    moved = type(episode)(
        **{
            **{name: getattr(episode, name) for name in type(episode).__dataclass_fields__},
            "robot_m": episode.robot_m @ turn + shift,
            "robot_mps": episode.robot_mps @ turn,
            "robot_heading_rad": episode.robot_heading_rad + angle,
            "people_m": episode.people_m @ turn + shift,
            "people_mps": episode.people_mps @ turn,
            "people_heading_rad": episode.people_heading_rad + angle,
            "goal_m": episode.goal_m @ turn + shift,
            "walls_m": (episode.walls_m.reshape(-1, 2) @ turn + shift).reshape(-1, 4),
        }
    )
    before, after = social_measures(episode), social_measures(moved)
    for name, value in before.items():
        expected = None if value is None else pytest.approx(value, rel=1e-6, abs=1e-6)
        assert after[name] == expected, name


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"t_s": [0.0, 0.0]}, "t_s must hold at least one time and increase"),
        ({"t_s": [0.0, 1.0, 2.0]}, "robot_m must have shape"),
        ({"goal_m": np.array([np.nan, 0.0])}, "goal_m must be finite"),
        ({"people_m": np.zeros((2, 2))}, r"people_m must have shape \(2, P, 2\)"),
        ({"people_heading_rad": np.zeros((2, 5))}, "people_heading_rad must have shape"),
        ({"robot_radius_m": -1.0}, "robot_radius_m must lie in"),
    ],
)
def test_an_episode_that_does_not_fit_together_is_refused(values, message):
    episode = formula_episode([0.0, 1.0], straight(1.0), [straight(0.0, (3.0, 0.0))])
    fields = {name: getattr(episode, name) for name in type(episode).__dataclass_fields__}
    with pytest.raises(SimError, match=message):
        type(episode)(**{**fields, **values})
