"""The motion of a rigid body against small steps, and under turns and mirrors of the world."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nav_adapter.rigid import Motion

speeds = st.floats(-2.0, 2.0)
motions = st.builds(Motion, speeds, speeds, st.floats(-3.0, 3.0), speeds, speeds, speeds)
times = st.floats(-2.0, 2.0)


@given(motions, times, times)
def test_motions_add_up(motion: Motion, first_s: float, then_s: float) -> None:
    both = motion.at(first_s).at(then_s)
    assert both == pytest.approx(motion.at(first_s + then_s), abs=1e-9)


@given(motions, speeds, speeds)
def test_each_point_moves_with_its_own_velocity(motion: Motion, ahead: float, left: float) -> None:
    step_s = 1e-6
    x, y = motion.point(ahead, left)
    later = motion.at(step_s).point(ahead, left)
    measured = (later[0] - x) / step_s, (later[1] - y) / step_s
    assert motion.velocity_at(x, y) == pytest.approx(measured, abs=1e-4)
    fastest_mps = motion.fastest_mps(math.hypot(ahead, left))
    assert math.hypot(*motion.velocity_at(x, y)) <= fastest_mps + 1e-9


@given(speeds, speeds, st.floats(0.1, 2.0), st.floats(0.0, 1.0))
def test_in_its_stopping_time_a_body_moves_as_far_as_until_it_has_braked(
    forward, rate, radius_m, reaction_s
):
    braking = reaction_s, 0.8, radius_m
    driving, turning = Motion(0.0, 0.0, 0.0, forward), Motion(0.0, 0.0, yaw_rate_radps=rate)
    for motion, fastest in ((driving, abs(forward)), (turning, abs(rate) * radius_m)):
        way_m = fastest * reaction_s + fastest**2 / (2.0 * 0.8)
        assert fastest * motion.stopping_s(*braking) == pytest.approx(way_m, abs=1e-9)
    both_s = driving._replace(yaw_rate_radps=rate).stopping_s(*braking)
    assert both_s == max(driving.stopping_s(*braking), turning.stopping_s(*braking))


@given(motions, times, st.floats(-3.0, 3.0))
def test_the_world_may_turn_and_be_mirrored(motion: Motion, time_s: float, turn: float) -> None:
    def turned(each: Motion) -> Motion:
        c, s = math.cos(turn), math.sin(turn)
        return each._replace(
            x_m=c * each.x_m - s * each.y_m,
            y_m=s * each.x_m + c * each.y_m,
            heading_rad=each.heading_rad + turn,
        )

    def mirrored(each: Motion) -> Motion:
        x, y, heading, forward, left, rate = each
        return Motion(x, -y, -heading, forward, -left, -rate)

    for moved in (turned, mirrored):
        assert moved(motion).at(time_s) == pytest.approx(moved(motion.at(time_s)), abs=1e-9)
