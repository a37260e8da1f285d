"""A robot that moves sideways is measured as one that moves forward: by its whole velocity."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from measured_scenes import ACROSS_M, BODY_RADIUS_M, crossing, walking

from sim_tests import NOVA_CARTER, run_crossing
from sim_tests.study.measures import Conduct, measure

T_S = np.arange(0.0, 8.001, 0.05)


def drifting(speed, course_rad, heading=0.0):
    """A robot that keeps its heading and moves in another direction; ``speed`` is of the time."""

    def robot(t):
        steps = np.arange(0.0, t + 1e-9, 0.01)
        way = 0.01 * sum(speed(step) for step in steps[:-1].tolist())
        forward, left = math.cos(course_rad - heading), math.sin(course_rad - heading)
        return (
            way * math.cos(course_rad),
            way * math.sin(course_rad),
            heading,
            speed(t) * forward,
            speed(t) * left,
        )

    return robot


def braking(t):
    """The speed 1 m/s, from 2 s on braked by 0.5 m/s²."""
    return min(max(1.0 - 0.5 * (t - 2.0), 0.0), 1.0)


def test_the_time_to_collision_is_that_of_the_way_to_the_side():
    gap = 4.0
    beside = walking((0.0, gap + ACROSS_M + BODY_RADIUS_M), (0.0, 0.0))
    record = measure(
        crossing([0.0, 0.05], drifting(lambda t: 0.8, 0.5 * math.pi), [beside], reached=False)
    )
    assert record.min_time_to_collision_s == pytest.approx((gap - 0.04) / 0.8, abs=1e-6)
    ahead = walking((gap, 0.0), (0.0, 0.0))
    record = measure(
        crossing([0.0, 0.05], drifting(lambda t: 0.8, 0.5 * math.pi), [ahead], reached=False)
    )
    assert record.min_time_to_collision_s is None  # it passes by


@pytest.mark.parametrize("course_deg", [90.0, -90.0, 45.0, 180.0])
def test_braking_jerk_stops_and_speeds_are_those_of_a_robot_that_faces_its_way(course_deg):
    course = math.radians(course_deg)
    person = walking((30.0, 30.0), (0.0, 0.0))
    across = measure(crossing(T_S, drifting(braking, course), [person], reached=False))
    facing = measure(crossing(T_S, drifting(braking, course, course), [person], reached=False))
    assert across.peak_deceleration_mps2 == pytest.approx(0.5, abs=0.01)
    assert across.stops == 1
    for name in ("peak_deceleration_mps2", "peak_jerk_mps3", "stops", "path_length_m"):
        assert getattr(across, name) == pytest.approx(getattr(facing, name), abs=1e-6), name
    steady = measure(crossing(T_S, drifting(lambda t: 0.8, course), [person], reached=False))
    assert steady.speed_at_min_separation_mps == pytest.approx(0.8, abs=1e-6)


def test_turning_is_no_braking():
    """The robot turns while its centre moves straight on."""

    def turning(t):
        return (t, 0.0, 0.5 * t, math.cos(0.5 * t), -math.sin(0.5 * t))

    assert measure(crossing(T_S, turning)).peak_deceleration_mps2 == pytest.approx(0.0, abs=0.01)
    assert measure(crossing(T_S, turning)).stops == 0


@given(st.floats(-math.pi, math.pi))
def test_a_limit_holds_in_every_direction(course_rad):
    times = [0.0, 0.05, 0.1]
    result = crossing(times, drifting(lambda t: 0.9, course_rad))
    frames = tuple(
        replace(
            frame,
            constraints=replace(
                frame.constraints,
                speed_limit_mps=0.4,
                reachable_speed_limit_mps=0.0,
                fastest_point_limit_mps=0.4,
            ),
        )
        for frame in result.frames
    )
    conduct = Conduct.of(replace(result, frames=frames))
    braked = 0.9 - 2 * 0.05 * NOVA_CARTER.max_deceleration_mps2
    assert conduct.limit_excess_mps == pytest.approx(0.9 - max(braked, 0.4), abs=1e-9)
    assert conduct.fastest_point_excess_mps == pytest.approx(conduct.limit_excess_mps)


def test_no_measure_depends_on_the_way_in_which_a_square_robot_faces():
    """The frame of a holonomic robot, turned by 90°: the same places, speeds and people."""
    square_m = 0.4 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    robot = replace(NOVA_CARTER, footprint_m=square_m)
    people = [walking((3.0, -3.0), (0.1, 0.9)), walking((5.0, 1.0), (-0.6, -0.1))]

    def measured(heading):
        like = {"footprint_m": square_m, "robot": robot, "time_without_people_s": 5.0}
        result = crossing(T_S, drifting(braking, 0.3, heading), people, **like)
        return measure(result), Conduct.of(result)

    (facing, obeys), (aside, obeys_aside) = measured(0.3), measured(0.3 - 0.5 * math.pi)
    assert obeys.limit_excess_mps == pytest.approx(obeys_aside.limit_excess_mps, abs=1e-9)
    assert facing.min_margin_m is not None
    assert facing.min_time_to_collision_s is not None
    assert facing.step_out_never > 0.0
    for name in facing.__dataclass_fields__:
        mine, yours = getattr(facing, name), getattr(aside, name)
        assert mine == (pytest.approx(yours, abs=3e-6) if isinstance(mine, float) else yours), name


class Strafer:
    """A planner that moves from side to side at 0.8 m/s, whatever the limit."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return 0.0, math.copysign(0.8, math.sin(robot_state.stamp_s)), 0.0


@pytest.mark.slow
def test_a_robot_that_strafes_past_its_limit_does_not_obey():
    result = run_crossing(
        "head_on_in_aisle", policy="balanced", planner=Strafer(), robot="omni", seed=0
    )
    limits = [frame.constraints.speed_limit_mps for frame in result.frames]
    assert min(limits) < 0.5
    conduct, record = Conduct.of(result), measure(result)
    assert conduct.limit_excess_mps > 0.1
    assert record.stops > 0
    assert record.peak_deceleration_mps2 > 0.5
