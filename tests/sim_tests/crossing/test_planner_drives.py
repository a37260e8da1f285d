"""The dynamic window of robots that steer or move sideways, in closed loop."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_scenes import DT_S, ROUNDING, constraints, drive, outline

from nav_adapter import RobotProfile, RobotState
from sim_tests.actors.robot import RobotModel
from sim_tests.crossing.planner import CostmapPlanner, ReferencePlanner

FORKLIFT = RobotModel.shipped("forklift").profile
OMNI = RobotModel.shipped("omni").profile
WIDE_AISLE = np.array([[-6.0, 2.0, 20.0, 3.0], [-6.0, -3.0, 20.0, -2.0]])


def run(
    robot: RobotProfile,
    start: RobotState,
    goal: tuple[float, float],
    *,
    boxes: np.ndarray | None = None,
    people: list | None = None,
    duration_s: float = 60.0,
) -> list[RobotState]:
    """Return the states until the robot stands at its goal, or the time is up."""
    planner, states, now = CostmapPlanner(robot, boxes), [start], constraints(people or [], 1.2)
    while states[-1].stamp_s < duration_s:
        states.append(drive(states[-1], planner.plan(states[-1], goal, now, DT_S)))
        if math.dist(states[-1].position_odom_m, goal) < 0.25 and states[-1].travel_mps < 0.2:
            break
    return states


def arrived(states: list[RobotState], goal: tuple[float, float]) -> bool:
    return math.dist(states[-1].position_odom_m, goal) < 0.25 and states[-1].travel_mps < 0.2


@pytest.mark.parametrize(
    ("x", "y", "heading_deg"),
    [(0.0, 0.64, 60.0), (1.0, 0.3, 90.0), (1.9, -1.16, 154.0)],
    ids=["at the rack", "across the aisle", "facing away"],
)
def test_a_robot_that_steers_reverses_out_of_a_dead_end(x, y, heading_deg) -> None:
    """No arc leads ahead to the goal, and it cannot turn on the spot."""
    start, goal = RobotState(0.0, (x, y), math.radians(heading_deg), 0.0, 0.0), (9.0, 0.0)
    racks = shapely.union_all(shapely.box(*WIDE_AISLE.T))
    states = run(FORKLIFT, start, goal, boxes=WIDE_AISLE)
    assert arrived(states, goal)
    assert min(state.speed_mps for state in states) < -0.1
    assert min(state.speed_mps for state in states) >= -0.3 - ROUNDING
    assert min(outline(state, FORKLIFT.footprint_m).distance(racks) for state in states) > 0.03
    for before, state in pairwise(states):
        if before.speed_mps * state.speed_mps >= 0.0:  # it speeds up alike either way
            faster_mps = abs(state.speed_mps) - abs(before.speed_mps)
            assert faster_mps <= FORKLIFT.max_acceleration_mps2 * DT_S + ROUNDING
    for state in states:
        assert abs(state.yaw_rate_radps) <= abs(state.speed_mps) / 1.3 + ROUNDING
        # Forward and backward, the corners keep the limit too.
        corners_mps = abs(state.yaw_rate_radps) * FORKLIFT.circumscribed_radius_m
        assert abs(state.speed_mps) + corners_mps <= 1.2 + ROUNDING


def test_a_goal_beside_a_robot_that_steers_is_reached() -> None:
    """No forward arc of 1.3 m leads to a place 0.8 m to its left."""
    goal = (0.2, 0.8)
    assert arrived(run(FORKLIFT, RobotState(0.0, (0.0, 0.0), 0.0, 0.0, 0.0), goal), goal)


def test_a_robot_that_steers_waits_for_people_and_does_not_reverse() -> None:
    """A person blocks the aisle ahead; that is no dead end."""
    people = [((4.0, 0.0), (0.0, 0.0), 1.6)]
    states = run(
        FORKLIFT,
        RobotState(0.0, (0.0, 0.0), 0.0, 0.0, 0.0),
        (9.0, 0.0),
        boxes=WIDE_AISLE,
        people=people,
        duration_s=12.0,
    )
    assert min(state.speed_mps for state in states) == 0.0
    assert states[-1].speed_mps < 0.05


def test_a_holonomic_robot_passes_a_person_sideways_and_looks_ahead() -> None:
    people, goal = [((4.0, 0.1), (0.0, 0.0), 0.6)], (9.0, 0.0)
    states = run(OMNI, RobotState(0.0, (0.0, 0.0), 0.0, 0.0, 0.0, np.zeros(2)), goal, people=people)
    assert arrived(states, goal)
    assert max(abs(state.lateral_mps) for state in states) > 0.2
    assert max(abs(state.heading_odom_rad) for state in states) < 0.6
    person = shapely.Point(4.0, 0.1)
    assert min(outline(state, OMNI.footprint_m).distance(person) for state in states) > 0.6


@settings(max_examples=100, deadline=None)
@given(
    st.tuples(st.floats(-1.0, 1.0), st.floats(-0.8, 0.8), st.floats(-1.0, 1.0)),
    st.floats(0.0, 1.4),
    st.lists(
        st.tuples(
            st.tuples(st.floats(-3, 4), st.floats(-3, 3)),
            st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)),
            st.floats(0.4, 1.2),
        ),
        max_size=2,
    ),
    st.sampled_from([None, WIDE_AISLE]),
)
def test_velocities_of_a_holonomic_robot_keep_the_limits(twist, limit_mps, people, boxes) -> None:
    forward, left, yaw_rate = twist
    forward, left = (0.8 * each for each in (forward, left))
    state = RobotState(0.0, (0.0, 0.0), 0.2, forward, yaw_rate, np.array([forward, left]))
    command = ReferencePlanner(OMNI, boxes).plan(
        state, (8.0, 0.0), constraints(people, limit_mps), DT_S
    )
    x, y, w = command
    radius_m = OMNI.circumscribed_radius_m
    change = math.hypot(x - forward, y - left)
    # A change of direction speeds up one part and slows down the other.
    assert change <= OMNI.max_deceleration_mps2 * DT_S + ROUNDING
    assert abs(w - yaw_rate) <= OMNI.max_yaw_acceleration_radps2 * DT_S + ROUNDING
    if math.hypot(x, y) + abs(w) * radius_m > limit_mps + ROUNDING:  # it was too fast: it brakes
        assert math.hypot(forward, left) + abs(yaw_rate) * radius_m > limit_mps
        assert math.hypot(x, y) <= max(math.hypot(forward, left) - 0.05, 0.0) + ROUNDING
