import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests.actors.robot import NOVA_CARTER
from sim_tests.crossing import CLEARANCE_M, SafetyMeter

AHEAD = np.array([1.0, 0.0])


def protective(v, v_h, a=1.0, reaction=0.3, clearance=CLEARANCE_M):
    return v_h * (reaction + v / a) + v * reaction + v * v / (2 * a) + clearance


@given(st.floats(0.05, 2.0), st.floats(0.0, 2.0), st.floats(0.0, 5.0))
def test_the_margin_is_the_separation_minus_the_protective_separation(speed, human, separation):
    meter = SafetyMeter(NOVA_CARTER)
    margin = meter.add_separation(separation, speed * AHEAD, -human * AHEAD, AHEAD, 0.05)
    assert margin == pytest.approx(separation - protective(speed, human))
    assert meter.min_margin_m == margin
    assert meter.violation_time_s == (0.05 if margin < 0 else 0.0)


def test_only_motion_towards_each_other_needs_a_protective_separation():
    meter = SafetyMeter(NOVA_CARTER)
    apart = meter.add_separation(1.0, -AHEAD, AHEAD, AHEAD, 0.05)
    assert apart == pytest.approx(1.0 - CLEARANCE_M)
    across = meter.add_separation(1.0, np.array([0.0, 1.0]), np.array([0.0, -1.0]), AHEAD, 0.05)
    assert across == pytest.approx(1.0 - CLEARANCE_M)


def test_a_standing_robot_violates_no_margin():
    meter = SafetyMeter(NOVA_CARTER)
    meter.add_separation(0.05, np.zeros(2), -2.0 * AHEAD, AHEAD, 0.05)
    assert meter.violation_time_s == 0.0
    assert meter.min_separation_m == 0.05


def test_a_contact_is_counted_once_and_attributed_to_its_cause():
    meter = SafetyMeter(NOVA_CARTER)
    for t in (1.0, 1.004, 1.008):
        meter.touch(t, 0, 0.5 * AHEAD, AHEAD)
    meter.release(0)
    meter.touch(2.0, 0, np.zeros(2), AHEAD)
    meter.touch(2.0, 1, -0.5 * AHEAD, AHEAD)
    assert [(c.t_s, c.worker, c.by) for c in meter.contacts] == [
        (1.0, 0, "robot"),
        (2.0, 0, "person"),
        (2.0, 1, "person"),
    ]


def test_the_top_speed_is_measured_only_near_people():
    meter = SafetyMeter(NOVA_CARTER)
    meter.add_separation(2.5, 1.4 * AHEAD, np.zeros(2), AHEAD, 0.05)
    meter.add_separation(1.5, 0.6 * AHEAD, np.zeros(2), AHEAD, 0.05)
    assert meter.max_speed_near_mps == pytest.approx(0.6)
