"""Measures that others use: equal to computations from their definitions, and to known values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from social_reference import reference_measures
from social_scenes import random_episode, straight_episode

from sim_tests import SimError
from sim_tests.study.social import SOCIAL_MEASURES, social_measures


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


def test_a_robot_that_strafes_is_measured_as_one_that_faces_its_way():
    """The same course with the heading turned by 90°; only measures of the heading may differ."""
    facing = random_episode(3)
    fields = {name: getattr(facing, name) for name in type(facing).__dataclass_fields__}
    turned = facing.robot_heading_rad + 0.5 * np.pi
    aside = type(facing)(**{**fields, "robot_heading_rad": turned})
    mine, yours = social_measures(facing), social_measures(aside)
    of_the_heading = {name for name in mine if "irregularity" in name or "goal_angle" in name}
    assert len(of_the_heading) == 3
    for name in mine.keys() - of_the_heading:
        assert mine[name] == pytest.approx(yours[name], abs=1e-9), name


def test_without_people_their_measures_do_not_apply():
    measured = social_measures(random_episode(1, people=0))
    ours = random_episode(1, people=0)
    for name in (
        "time_to_collision_s",
        "intimate_distance_s",
        "hunav_social_work_mps2",
        "people_jerk_mps3",
    ):
        assert measured[name] is None
    assert measured["hunav_path_length_m"] > 0.0
    assert measured["hunav_obstacle_force_mps2"] > 0.0
    assert ours.groups == ()


@settings(max_examples=25)
@given(st.booleans(), st.floats(1.0, 50.0), st.floats(1.0, 50.0), st.floats(1.0, 50.0))
def test_spl_and_stl_are_shares_that_only_the_reference_reaches(success, length, best, time):
    figures = {"success": success, "time_to_goal_s": time}
    best_figures = {"reference_time_s": best, "reference_length_m": best}
    episode = straight_episode([0.0, 1.0], length, **figures, **best_figures)
    measured = social_measures(episode)
    for name, actual in (("spl", length), ("stl", time)):
        assert 0.0 <= measured[name] <= 1.0
        assert (measured[name] == 1.0) == (success and actual <= best)


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
    episode = straight_episode([0.0, 1.0], standing_m=[(3.0, 0.0)])
    fields = {name: getattr(episode, name) for name in type(episode).__dataclass_fields__}
    with pytest.raises(SimError, match=message):
        type(episode)(**{**fields, **values})
