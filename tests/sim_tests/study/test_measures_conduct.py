"""Obedience to both limits, and the time of plan(), on frames whose figures are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from measured_scenes import crossing

from sim_tests import NOVA_CARTER, SimError
from sim_tests.study.measures import (
    OVERSHOOT_MPS,
    Conduct,
    fastest_point_excess_mps,
    limit_excess_mps,
)

DT_S = 0.05
BRAKING_MPS2 = NOVA_CARTER.max_deceleration_mps2
RADIUS_M = NOVA_CARTER.circumscribed_radius_m


def drive(speeds, limits, *, yaw_rates=None, fastest=None, plan_s=None):
    """A crossing with these speeds and limits, one of each per cycle of 0.05 s."""
    result = crossing(DT_S * np.arange(len(speeds)), lambda t: (0.0, 0.0, 0.0, 0.0))
    frames = []
    for index, frame in enumerate(result.frames):
        state = replace(
            frame.robot_state,
            speed_mps=float(speeds[index]),
            yaw_rate_radps=0.0 if yaw_rates is None else float(yaw_rates[index]),
        )
        constraints = replace(
            frame.constraints,
            speed_limit_mps=float(limits[index]),
            reachable_speed_limit_mps=0.0,
            fastest_point_limit_mps=None if fastest is None else float(fastest[index]),
        )
        elapsed_s = 0.0 if plan_s is None else float(plan_s[index])
        frames.append(replace(frame, robot_state=state, constraints=constraints, plan_s=elapsed_s))
    return replace(result, frames=tuple(frames))


def excess(speeds, limits):
    return limit_excess_mps(drive(speeds, limits).frames, NOVA_CARTER)


def test_the_limit_of_the_cycle_before_counts():
    assert excess([0.5, 0.5, 0.5], [0.5, 0.5, 0.0]) == pytest.approx(0.0)
    assert excess([0.5, 0.7, 0.5], [0.5, 0.9, 0.9]) == pytest.approx(0.2)
    assert excess([0.1, 0.1], [0.5, 0.5]) == pytest.approx(-0.4)


def test_full_braking_is_allowed_where_the_limit_falls_suddenly():
    braking = np.maximum(1.5 - BRAKING_MPS2 * DT_S * np.arange(40), 0.2)
    limits = np.full(40, 0.2)
    limits[0] = 1.5
    speeds = np.concatenate([[1.5], braking[:-1]])
    assert excess(speeds, limits) == pytest.approx(0.0, abs=1e-9)


def test_a_robot_that_does_not_brake_exceeds_the_limit_by_the_whole_difference():
    assert excess(np.full(40, 1.5), np.full(40, 0.5)) == pytest.approx(1.0)


def test_a_robot_that_brakes_at_half_the_rate_is_found():
    speeds = np.maximum(1.5 - 0.5 * BRAKING_MPS2 * DT_S * np.arange(60), 0.2)
    # After 1.3 s a full brake has reached 0.2 m/s, and this one 0.85 m/s.
    assert excess(speeds, np.full(60, 0.2)) == pytest.approx(0.65, abs=0.03)


def test_a_slow_robot_may_not_use_what_braking_from_a_higher_speed_would_allow():
    limits = np.full(40, 0.2)
    limits[0] = 1.5
    assert excess(np.full(40, 0.5), limits) == pytest.approx(0.3)


def test_reversing_counts_as_speed():
    assert excess([-0.5, -0.5, -0.5], [0.3, 0.3, 0.3]) > OVERSHOOT_MPS


@given(st.lists(st.tuples(st.floats(0.0, 1.5), st.floats(0.0, 1.0)), min_size=2, max_size=40))
def test_a_robot_that_follows_the_limit_with_full_braking_never_exceeds_it(cycles):
    """The robot takes any share of what it may have."""
    limits = [limit for limit, _ in cycles]
    speeds = [limits[0]]
    for limit, (_, share) in zip(limits, cycles[1:], strict=False):
        least = max(speeds[-1] - BRAKING_MPS2 * DT_S, 0.0)
        speeds.append(least if least > limit else least + share * (limit - least))
    assert excess(speeds, limits) <= 1e-9


def test_fewer_than_two_cycles_have_no_excess():
    assert excess([1.0], [0.0]) is None


def fastest_excess(speeds, yaw_rates, fastest):
    result = drive(speeds, np.zeros(len(speeds)), yaw_rates=yaw_rates, fastest=fastest)
    return fastest_point_excess_mps(result.frames, NOVA_CARTER)


def test_the_fastest_point_is_a_corner_of_a_turning_robot():
    found = fastest_excess([0.3] * 40, [-0.8] * 40, [0.5] * 40)
    assert found == pytest.approx(0.3 + 0.8 * RADIUS_M - 0.5)
    assert fastest_excess([0.3] * 40, [0.0] * 40, [0.5] * 40) == pytest.approx(-0.2)


def test_without_a_limit_for_the_fastest_point_there_is_no_excess():
    assert fastest_excess([0.3] * 3, [2.0] * 3, [math.inf] * 3) is None
    # A limit begins in the last cycle but one; from a higher speed, one cycle of braking is left.
    speed = 1.0 + 1.0 * RADIUS_M
    found = fastest_excess([1.0] * 3, [1.0] * 3, [math.inf, 0.5, 0.5])
    assert found == pytest.approx(speed - (speed - BRAKING_MPS2 * DT_S))


def test_a_conduct_has_the_times_of_plan():
    result = drive(np.zeros(101), np.ones(101), plan_s=1e-3 * np.arange(101))
    conduct = Conduct.of(result)
    assert conduct.plan_calls == 101
    assert conduct.plan_median_s == pytest.approx(0.050)
    assert conduct.plan_p99_s == pytest.approx(0.099)
    assert conduct.cycle_s == pytest.approx(DT_S)
    assert conduct.limit_excess_mps == pytest.approx(-1.0)


def test_a_conduct_needs_frames():
    with pytest.raises(SimError, match="at least one control cycle"):
        Conduct.of(replace(drive([0.0], [0.0]), frames=()))
