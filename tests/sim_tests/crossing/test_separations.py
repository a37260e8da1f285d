import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests.actors.robot import NOVA_CARTER
from sim_tests.crossing import ContactEvent, SafetyFigures, contact_by
from sim_tests.crossing._separations import CLEARANCE_M, Approach, Separations

AHEAD = (1.0, 0.0)


def protective(v, v_h, a=1.0, reaction=0.3, clearance=CLEARANCE_M):
    return v_h * (reaction + v / a) + v * reaction + v * v / (2 * a) + clearance


def separations(separation_m, robot_mps, person_mps=(0.0, 0.0), t_s=0.0):
    """A robot and a person straight ahead of it."""
    approach = Approach(separation_m, AHEAD, robot_mps, person_mps)
    return Separations(t_s, 0.05, NOVA_CARTER, robot_mps != (0.0, 0.0), (approach,))


def figures(*observed):
    result = SafetyFigures()
    for each in observed:
        result = result.after(each.t_s, each)
    return result


@given(st.floats(0.05, 2.0), st.floats(0.0, 2.0), st.floats(0.0, 5.0))
def test_the_margin_is_the_separation_minus_the_protective_separation(speed, human, separation):
    now = separations(separation, (speed, 0.0), (-human, 0.0))
    (margin,) = now.margins_m
    assert margin == pytest.approx(separation - protective(speed, human))
    assert figures(now).min_margin_m == margin
    assert figures(now).violation_time_s == (0.05 if margin < 0 else 0.0)


def test_only_motion_towards_each_other_needs_a_protective_separation():
    for robot_mps, person_mps in (((-1.0, 0.0), AHEAD), ((0.0, 1.0), (0.0, -1.0))):
        now = separations(1.0, robot_mps, person_mps)
        assert now.margins_m == pytest.approx((1.0 - CLEARANCE_M,))


def test_a_standing_robot_violates_no_margin():
    found = figures(separations(0.05, (0.0, 0.0), (-2.0, 0.0)))
    assert found.violation_time_s == 0.0
    assert found.min_margin_m == np.inf
    assert found.min_separation_m == 0.05


def test_the_top_speed_counts_only_near_people():
    found = figures(separations(2.5, (1.4, 0.0)), separations(1.5, (0.6, 0.0), t_s=0.05))
    assert found.max_speed_within_2m_mps == pytest.approx(0.6)


def test_separations_of_an_earlier_cycle_count_once():
    now = separations(0.1, AHEAD)
    assert figures(now).after(0.05, now) == figures(now)
    assert figures(now).after(0.0, now).violation_time_s == 0.1


def test_nobody_about_gives_no_figure():
    alone = Separations(0.0, 0.05, NOVA_CARTER, True, ())
    assert figures(alone) == SafetyFigures()


def test_a_contact_is_attributed_to_its_cause():
    into, aside, away = (
        ContactEvent(1.0, 0, Approach(0.0, AHEAD, velocity))
        for velocity in ((0.5, 0.0), (0.0, 0.5), (-0.5, 0.0))
    )
    assert [each.by for each in (into, aside, away)] == ["robot", "person", "person"]
    assert {each.robot_speed_mps for each in (into, aside, away)} == {0.5}
    assert contact_by(()) == ""
    assert contact_by((aside, away)) == "person"
    assert contact_by((aside, into, away)) == "robot"
