"""Way, stops, braking and jerk of known profiles."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests.crossing import STANDING_SPEED_MPS
from sim_tests.study.measures import path_length_m
from sim_tests.study.measures._driving import (
    count_stops,
    peak_deceleration_and_jerk,
    success_weighted,
)

T_S = np.arange(0.0, 8.0, 0.05)


@given(st.floats(0.2, 2.0), st.floats(-2.0, 2.0))
def test_a_parabola_of_speed_has_its_own_jerk_and_deceleration(braking, jerk):
    """v = v₀ − b t − j t²/2 for a robot that keeps rolling forwards."""
    t = np.arange(0.0, 2.01, 0.05)
    speed = 10.0 - braking * t - 0.5 * jerk * t**2
    deceleration, peak = peak_deceleration_and_jerk(t, speed)
    assert peak == pytest.approx(abs(jerk), abs=1e-9)
    # Where the window fits: 0.25 s from the ends.
    ends = braking + jerk * np.array([0.25, 1.75])
    assert deceleration == pytest.approx(max(ends.max(), 0.0), abs=1e-9)


@pytest.mark.parametrize("dt_s", [0.05, 1.0 / 60.0, 0.1])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_braking_counts_in_either_direction_and_is_never_overstated(dt_s, sign):
    t = np.arange(0.0, 8.0, dt_s)
    speed = sign * np.clip(1.5 - 1.0 * (t - 2.0), 0.0, 1.5)
    deceleration, jerk = peak_deceleration_and_jerk(t, speed)
    assert deceleration == pytest.approx(1.0, abs=0.01)
    assert deceleration <= 1.0 + 1e-9
    assert 2.5 < jerk < 5.0  # a sudden m/s² spreads over the window; see docs/measures.md


def test_white_noise_of_the_speed_counts_as_documented():
    """1 mm/s of noise reads as 1.9 mm/s² and 27 mm/s³ in standard deviation at 20 Hz."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 200.0, 0.05)
    speed = 1.0 + rng.normal(0.0, 1e-3, len(t))
    deceleration, jerk = peak_deceleration_and_jerk(t, speed)
    assert deceleration < 5.0 * 1.91e-3
    assert jerk < 5.0 * 27.3e-3


@pytest.mark.parametrize("count", [0, 1, 2, 10])
def test_an_episode_shorter_than_the_window_has_no_figure(count):
    assert peak_deceleration_and_jerk(T_S[:count], np.zeros(count)) == (None, None)


def test_path_length_of_a_circle():
    angle = np.linspace(0.0, 2.0 * np.pi, 1001)
    circle = 2.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert path_length_m(circle) == pytest.approx(4.0 * np.pi, rel=1e-5)
    assert path_length_m(np.zeros((1, 2))) == 0.0


@given(st.floats(0.1, 100.0), st.floats(0.1, 100.0))
def test_spl_is_the_formula_of_anderson(path, shortest):
    assert success_weighted(True, path, shortest) == shortest / max(path, shortest)
    assert success_weighted(False, path, shortest) == 0.0
    assert success_weighted(True, path, None) is None


def stops(profile, arrived=False):
    speeds_mps = np.array(profile)
    return count_stops(speeds_mps, speeds_mps <= STANDING_SPEED_MPS, arrived)


def test_stops_are_counted_once_each_and_not_at_the_goal():
    assert stops([0.0, 0.0, 0.5, 1.0]) == 0  # stood before it set out
    assert stops([0.5, 0.0, 0.0, 0.5, 0.01, 0.5]) == 2
    assert stops([0.5, 0.02, 0.05, 0.02, 0.09, 0.0]) == 1  # creeping on is not setting out
    assert stops([0.5, 0.0, 0.5, 0.0], arrived=True) == 1
    assert stops([0.5, 0.0, 0.5, 0.1], arrived=True) == 1  # arrived rolling
    assert stops([0.5, 0.0, -0.5, 0.0]) == 2  # backwards is driving too
    assert stops([0.5, 0.0, 0.5, 0.0], arrived=False) == 2  # stuck at the end
