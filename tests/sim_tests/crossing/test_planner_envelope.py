"""Planners' commands within the limit of the robot's fastest point, and its curve."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_scenes import AISLE, DT_S, ROUNDING, constraints, coordinate, drive, person_data

from nav_adapter import NavConstraints, RobotProfile, RobotState
from sim_tests.actors.robot import NOVA_CARTER
from sim_tests.crossing.planner import CostmapPlanner, ReferencePlanner
from sim_tests.crossing.planner._sampling import Sampling

# A tricycle whose base origin lies on the rear axle, with forks behind it.
TRICYCLE = RobotProfile(
    footprint_m=[[1.4, 0.4], [-0.8, 0.4], [-0.8, -0.4], [1.4, -0.4]],
    max_speed_mps=1.2,
    max_acceleration_mps2=0.6,
    max_deceleration_mps2=0.8,
    reaction_time_s=0.3,
    drive="ackermann",
    max_yaw_rate_radps=0.7,
    max_yaw_acceleration_radps2=1.0,
    min_turning_radius_m=1.4,
)
SLUGGISH = replace(NOVA_CARTER, max_yaw_rate_radps=0.4, max_yaw_acceleration_radps2=0.8)
ROBOTS = [NOVA_CARTER, SLUGGISH, TRICYCLE]


@st.composite
def situations(draw: st.DrawFn) -> tuple[RobotProfile, RobotState, NavConstraints]:
    """Return a robot in motion, within or above limits of which one may have fallen just now."""
    robot = draw(st.sampled_from(ROBOTS))
    limit = draw(st.floats(0.0, 1.5))
    fastest = draw(st.sampled_from([limit, limit + 0.3, math.inf]))
    speed = draw(st.floats(0.0, robot.max_speed_mps))
    turn = draw(st.floats(-1.0, 1.0)) * (robot.max_yaw_rate_radps or 0.0)
    if robot.min_turning_radius_m is not None:
        turn *= min(1.0, speed / robot.min_turning_radius_m / (robot.max_yaw_rate_radps or 1.0))
    state = RobotState(
        0.0, (draw(coordinate), draw(st.floats(-0.6, 0.6))), draw(st.floats(-3.0, 3.0)), speed, turn
    )
    return robot, state, constraints(draw(st.lists(person_data, max_size=2)), limit, fastest)


@settings(max_examples=200, deadline=None)
@given(situations(), st.sampled_from([None, AISLE]))
def test_no_point_of_the_robot_is_commanded_above_the_limit(situation, boxes) -> None:
    robot, state, now = situation
    speed, yaw_rate = ReferencePlanner(robot, boxes).plan(state, (8.0, 0.0), now, DT_S)
    radius_m = robot.circumscribed_radius_m
    fastest_mps = speed + abs(yaw_rate) * radius_m
    if fastest_mps <= now.fastest_point_limit_mps + ROUNDING:
        return
    # Only a robot that was too fast is still too fast: it brakes fully and does not turn harder.
    assert state.speed_mps + abs(state.yaw_rate_radps) * radius_m > now.fastest_point_limit_mps
    braked_mps = max(state.speed_mps - robot.max_deceleration_mps2 * DT_S, 0.0)
    assert speed == pytest.approx(braked_mps, abs=ROUNDING)
    assert abs(yaw_rate) <= abs(state.yaw_rate_radps) + ROUNDING


@settings(max_examples=200, deadline=None)
@given(situations(), st.sampled_from([None, AISLE]))
def test_commands_keep_to_the_limits_of_the_profile(situation, boxes) -> None:
    robot, state, now = situation
    speed, yaw_rate = ReferencePlanner(robot, boxes).plan(state, (8.0, 0.0), now, DT_S)
    assert speed <= max(robot.max_speed_mps, state.speed_mps)
    assert speed - state.speed_mps <= robot.max_acceleration_mps2 * DT_S + ROUNDING
    assert state.speed_mps - speed <= robot.max_deceleration_mps2 * DT_S + ROUNDING
    assert abs(yaw_rate) <= max(robot.max_yaw_rate_radps, abs(state.yaw_rate_radps)) + ROUNDING
    if robot.min_turning_radius_m is None:
        step = robot.max_yaw_acceleration_radps2 * DT_S
        assert abs(yaw_rate - state.yaw_rate_radps) <= step + ROUNDING
    else:
        assert abs(yaw_rate) <= abs(speed) / robot.min_turning_radius_m + ROUNDING  # or backward


@pytest.mark.parametrize("robot", [NOVA_CARTER, SLUGGISH], ids=["Nova Carter", "sluggish"])
def test_a_limited_robot_passes_somebody_who_stands_and_obeys_all_the_way(robot) -> None:
    """With 0.6 m/s for its fastest point a robot turns past a person and on to its goal."""
    planner, state = CostmapPlanner(robot), RobotState(0.0, (0.0, 0.0), 0.0, 0.0, 0.0)
    now = constraints([((4.0, 0.1), (0.0, 0.0), 0.6)], 0.6, 0.6)
    fastest_mps = []
    while state.position_odom_m[0] < 7.5 and state.stamp_s < 40.0:
        state = drive(state, planner.plan(state, (9.0, 0.0), now, DT_S))
        corners_mps = abs(state.yaw_rate_radps) * robot.circumscribed_radius_m
        fastest_mps.append(state.speed_mps + corners_mps)
    assert state.stamp_s < 25.0
    assert abs(state.position_odom_m[1]) < 1.0
    assert max(fastest_mps) <= 0.6 + ROUNDING
    assert max(fastest_mps) > 0.55  # it uses what it may


def test_a_robot_that_stops_slowly_looks_farther_ahead() -> None:
    assert Sampling.of(NOVA_CARTER).horizon_s == 3.0
    heavy = replace(NOVA_CARTER, max_speed_mps=2.0, max_deceleration_mps2=0.8)
    assert Sampling.of(heavy).horizon_s == pytest.approx(2.0 * 2.0 / 0.8)
