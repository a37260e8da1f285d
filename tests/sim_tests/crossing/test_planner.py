"""The dynamic window in closed loop with an exact unicycle, and properties of its commands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_scenes import (
    AISLE,
    DT_S,
    HALF_LENGTH_M,
    OUTLINE_M,
    ROBOT,
    at_rest,
    constraints,
    coordinate,
    outline,
    person_data,
)

from nav_adapter import RobotProfile, RobotState
from sim_tests.crossing.planner import CostmapPlanner, ReferencePlanner

GOAL = (8.0, 0.0)
EMPTY_TIME_S = 8.0 / 1.5 + 1.5 / 2 + 1.5 / 2 / 0.6  # trapezoid, arriving at 0.6 m/s²

Walker = Callable[[float], tuple[tuple[float, float], tuple[float, float], float]]


def walker(x: float, y: float, vx: float, vy: float, radius_m: float) -> Walker:
    return lambda t: ((x + vx * t, y + vy * t), (vx, vy), radius_m)


def gap_m(state: RobotState, center: tuple[float, float], radius_m: float) -> float:
    """Return the exact distance from the robot's outline to a disc, negative where they overlap."""
    return float(shapely.distance(outline(state), shapely.Point(center))) - radius_m


def drive(state: RobotState, command: tuple[float, float], dt_s: float = DT_S) -> RobotState:
    """Drive an exact arc at the mean of the old and the commanded twist."""
    speed = 0.5 * (state.speed_mps + command[0])
    turn = 0.5 * (state.yaw_rate_radps + command[1]) * dt_s
    chord = speed * dt_s * float(np.sinc(0.5 * turn / math.pi))
    middle = state.heading_odom_rad + 0.5 * turn
    x, y = state.position_odom_m + chord * np.array([math.cos(middle), math.sin(middle)])
    heading = state.heading_odom_rad + turn
    return RobotState(state.stamp_s + dt_s, (x, y), heading, *command)


@dataclass
class Run:
    """States tick by tick and the gap to each person at each of them."""

    states: list[RobotState]
    gaps_m: np.ndarray
    arrived: bool

    @property
    def duration_s(self) -> float:
        return self.states[-1].stamp_s

    @property
    def speeds_mps(self) -> np.ndarray:
        return np.array([state.speed_mps for state in self.states])

    @property
    def path_m(self) -> np.ndarray:
        return np.array([state.position_odom_m for state in self.states])


def simulate(
    people: list[Walker],
    goal: tuple[float, float] = GOAL,
    *,
    boxes: np.ndarray | None = None,
    start: RobotState | None = None,
    duration_s: float = 25.0,
    limit_mps: Callable[[float], float] = lambda _: 1.5,
) -> Run:
    planner = CostmapPlanner(ROBOT, boxes)
    states, gaps = [start if start is not None else at_rest()], []
    arrived = False
    while not arrived and states[-1].stamp_s < duration_s:
        state = states[-1]
        now = [person(state.stamp_s) for person in people]
        command = planner.plan(state, goal, constraints(now, limit_mps(state.stamp_s)), DT_S)
        gaps.append([gap_m(state, center, radius) for center, _, radius in now])
        states.append(drive(state, command))
        distance = math.hypot(*(states[-1].position_odom_m - goal))
        arrived = distance <= 0.1 and states[-1].speed_mps == 0.0
    return Run(states, np.array(gaps), arrived)


def reversals(speeds: np.ndarray) -> int:
    """Return how often the acceleration changes its sign."""
    change = np.diff(speeds)
    signs = np.sign(change[np.abs(change) > 0.02])
    return int((np.diff(signs) != 0).sum())


# --- behaviour in closed loop ------------------------------------------------------------------


def test_without_obstacles_the_robot_drives_straight_at_full_speed_without_overshoot() -> None:
    run = simulate([])
    assert run.arrived
    assert np.abs(run.path_m[:, 1]).max() < 1e-9
    assert run.path_m[:, 0].max() <= 8.0
    assert run.speeds_mps.max() == pytest.approx(1.5)
    assert run.duration_s == pytest.approx(EMPTY_TIME_S, abs=0.3)
    assert reversals(run.speeds_mps) == 1


@settings(max_examples=25, deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(0.12, 4.0), st.floats(0.0, 1.5))
def test_a_goal_in_any_direction_is_reached(bearing: float, distance: float, speed: float) -> None:
    goal = (distance * math.cos(bearing), distance * math.sin(bearing))
    run = simulate([], goal, start=RobotState(0.0, (0, 0), 0.0, speed, 0.0))
    assert run.arrived
    assert run.duration_s < 10.0


def test_a_standing_person_in_an_aisle_is_passed_if_the_radius_permits() -> None:
    run = simulate([walker(4.0, 0.0, 0.0, 0.0, 0.5)], boxes=AISLE)
    assert run.arrived
    assert run.gaps_m.min() > 0.05
    walls = shapely.union_all(shapely.box(*AISLE.T))
    assert min(outline(state).distance(walls) for state in run.states) > 0.05
    assert run.duration_s < EMPTY_TIME_S + 3.0


def test_a_robot_waits_while_a_radius_blocks_the_aisle_and_continues_when_it_shrinks() -> None:
    def person(t: float) -> tuple[tuple[float, float], tuple[float, float], float]:
        return (4.0, 0.0), (0.0, 0.0), 1.0 if t < 12.0 else 0.45

    waiting = simulate([person], boxes=AISLE, duration_s=12.0)
    assert not waiting.arrived
    assert waiting.gaps_m.min() > 0.05
    assert waiting.speeds_mps[-40:].max() < 0.05
    assert simulate([person], boxes=AISLE, duration_s=25.0).arrived


@pytest.mark.parametrize("limit_mps", [0.0, 0.4])
def test_a_lower_limit_is_met_by_full_braking(limit_mps: float) -> None:
    run = simulate([], limit_mps=lambda t: 1.5 if t < 2.0 else limit_mps, duration_s=5.0)
    times = np.array([state.stamp_s for state in run.states])
    expected = np.maximum(1.5 - (times - 2.0), limit_mps)
    after = times > 2.0 + 0.5 * DT_S
    np.testing.assert_allclose(run.speeds_mps[after], expected[after], atol=1e-9)


def test_a_robot_in_a_disc_from_behind_drives_out() -> None:
    run = simulate([walker(-0.8, 0.1, 0.0, 0.0, 1.0)])
    assert run.arrived
    assert run.gaps_m[0, 0] < -0.5
    assert (np.diff(run.gaps_m[:, 0]) > -1e-3)[run.gaps_m[:-1, 0] < 0.0].all()


@pytest.mark.parametrize("y_m", [0.0, 0.3])
def test_a_robot_in_a_disc_from_ahead_turns_on_the_spot_and_drives_out(y_m: float) -> None:
    run = simulate([walker(1.0, y_m, 0.0, 0.0, 1.1)])
    assert run.gaps_m[0, 0] < -0.3
    swing = ROBOT.circumscribed_radius_m - HALF_LENGTH_M
    assert run.gaps_m.min() > run.gaps_m[0, 0] - swing - 0.01
    assert run.arrived


def test_a_person_who_walks_over_a_waiting_robot_does_not_freeze_it() -> None:
    def limit(t: float) -> float:
        return 0.0 if 2.0 < t < 6.0 else 1.5

    run = simulate([walker(8.0, 0.0, -1.2, 0.0, 1.0)], limit_mps=limit)
    assert run.gaps_m.min() < 0.0
    assert run.arrived


def test_a_robot_at_a_wall_keeps_enough_distance_to_turn_around() -> None:
    stuck = simulate([], (0.5, -3.0), boxes=AISLE, duration_s=10.0).states[-1]
    assert stuck.speed_mps < 0.05
    assert abs(math.sin(stuck.heading_odom_rad)) > 0.9  # it faces the wall
    again = simulate([], GOAL, boxes=AISLE, start=stuck)
    assert again.arrived


@pytest.mark.parametrize("seed", range(3))
def test_boxes_are_never_hit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    low = rng.uniform((1.0, -2.5), (7.0, 2.0), (6, 2))
    boxes = np.hstack([low, low + rng.uniform(0.2, 1.2, (6, 2))])
    person = walker(*rng.uniform((2, -4), (6, 4)), *rng.uniform(-1, 1, 2), 0.6)
    run = simulate([person], boxes=boxes, duration_s=10.0)
    solid = shapely.union_all(shapely.box(*boxes.T))
    assert min(outline(state).distance(solid) for state in run.states) > 0.04
    assert run.path_m[:, 0].max() > 0.5


@pytest.mark.parametrize("near_m", [1.5, 1.65])
def test_a_robot_amid_a_group_turns_round_and_leaves(near_m: float) -> None:
    """The swing of its corners towards people must not keep it there."""
    group = [(near_m, 0.9), (near_m + 0.5, 0.0), (near_m, -0.9)]
    people = [walker(x, y, 0.0, 0.0, 1.06) for x, y in group]
    run = simulate(people, (-8.0, 0.0), limit_mps=lambda _: 0.5)
    assert run.arrived
    assert run.path_m[:, 0].max() < 0.1


def test_an_off_centre_footprint_keeps_clear_of_the_wall() -> None:
    corners = OUTLINE_M + np.array([0.2, -0.15])
    planner = ReferencePlanner(RobotProfile(corners, 1.5, 1.0, 1.0, 0.3), AISLE)
    solid = shapely.union_all(shapely.box(*AISLE.T))
    state = at_rest()
    for _ in range(200):
        state = drive(state, planner.plan(state, (4.0, -2.0), constraints([]), DT_S))
        assert outline(state, corners).distance(solid) > 0.04
    assert state.position_odom_m[0] > 1.0


# --- properties of every command -----------------------------------------------------------------

people_data = st.lists(person_data, max_size=3)
state_data = st.builds(
    lambda x, y, heading, v, w: RobotState(0.0, (x, y), heading, v, w),
    coordinate,
    st.floats(-1.0, 1.0),
    st.floats(-math.pi, math.pi),
    st.floats(0.0, 1.5),
    st.floats(-1.2, 1.2),
)


@settings(max_examples=150, deadline=None)
@given(state_data, people_data, st.sampled_from([None, AISLE]))
def test_a_moving_robot_can_always_stop_clear_of_discs_and_boxes(
    state: RobotState, people: list, boxes: np.ndarray | None
) -> None:
    """Replay the command and full braking in fine steps against exact geometry."""
    planner = ReferencePlanner(ROBOT, boxes)
    v, w = planner.plan(state, GOAL, constraints(people), DT_S)
    if v == pytest.approx(max(state.speed_mps - DT_S, 0.0), abs=1e-9):
        return  # braking already: nothing better to ask for
    solid = shapely.union_all(shapely.box(*boxes.T)) if boxes is not None else shapely.Point()
    wall_now = outline(state).distance(solid) if boxes is not None else math.inf
    robot, fine_s = state, 0.01
    stop_s, yaw_stop_s = v, max(v, abs(w) / 3.0)
    while robot.speed_mps > 0.0 or robot.stamp_s < DT_S - 1e-9:
        t = robot.stamp_s + fine_s
        share = max(0.0, 1.0 - max(0.0, t - DT_S) / max(stop_s, 1e-9))
        yaw_share = max(0.0, 1.0 - max(0.0, t - DT_S) / max(yaw_stop_s, 1e-9))
        robot = drive(robot, (v * share, w * yaw_share), fine_s)
        for (x, y), (vx, vy), radius in people:
            center = (x + vx * t, y + vy * t)
            waiting = gap_m(state, center, radius)
            if waiting + radius < 0.3:
                return  # this person walks into the robot, whatever it does
            # Between the planner's samples the gap may be smaller by what a chord cuts off.
            assert gap_m(robot, center, radius) > min(0.02, waiting - 0.02)
        if boxes is not None:
            assert outline(robot).distance(solid) >= min(0.04, wall_now - 2e-3)


def turned(
    angle: float, shift: tuple[float, float], point: tuple[float, float]
) -> tuple[float, float]:
    c, s = math.cos(angle), math.sin(angle)
    return c * point[0] - s * point[1] + shift[0], s * point[0] + c * point[1] + shift[1]


@settings(max_examples=80, deadline=None)
@given(state_data, people_data, st.floats(-3.0, 3.0), st.tuples(coordinate, coordinate))
def test_turning_and_shifting_the_world_changes_nothing(
    state: RobotState, people: list, angle: float, shift: tuple[float, float]
) -> None:
    planner = ReferencePlanner(ROBOT)
    moved_state = RobotState(
        0.0,
        turned(angle, shift, state.position_odom_m),
        state.heading_odom_rad + angle,
        state.speed_mps,
        state.yaw_rate_radps,
    )
    moved = [(turned(angle, shift, c), turned(angle, (0, 0), v), r) for c, v, r in people]
    here = planner.plan(state, GOAL, constraints(people), DT_S)
    there = planner.plan(moved_state, turned(angle, shift, GOAL), constraints(moved), DT_S)
    assert there == pytest.approx(here, abs=1e-6)


def test_the_command_depends_only_on_the_arguments() -> None:
    used, fresh = ReferencePlanner(ROBOT, AISLE), ReferencePlanner(ROBOT, AISLE)
    scene = constraints([((3.0, 0.0), (-0.5, 0.2), 0.6)])
    for x in (1.0, 2.0, -1.0):
        used.plan(at_rest(x), GOAL, scene, DT_S)
    state = RobotState(0.0, (0.5, 0.1), 0.2, 1.0, 0.1)
    assert used.plan(state, GOAL, scene, DT_S) == fresh.plan(state, GOAL, scene, DT_S)


def headings_rad(
    state: RobotState, person: tuple[float, float, float], boxes: list[list[float]], ticks: int
) -> list[float]:
    """Return the headings of a robot at 0.5 m/s or less beside a person x, y, radius who stands."""
    x, y, radius_m = person
    now = constraints([((x, y), (0.0, 0.0), radius_m)], 0.5)
    planner = CostmapPlanner(ROBOT, np.array(boxes))
    headings = []
    for _ in range(ticks):
        state = drive(state, planner.plan(state, (12.0, 0.0), now, DT_S))
        headings.append(state.heading_odom_rad)
    return headings


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["right", "left"])
def test_a_slow_robot_does_not_turn_to_the_blocked_far_side_of_an_aisle(side: float) -> None:
    walls = [[-5.0, 1.75, 17.0, 2.0], [-5.0, -2.0, 17.0, -1.75]]
    state = RobotState(0.0, (5.9, side * 0.95), -side * math.radians(3.0), 0.2, 0.0)
    headings = headings_rad(state, (7.8, 0.0, 1.19), walls, 60)
    assert (side * np.array(headings)).min() > -math.radians(30.0)


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["right", "left"])
def test_a_slow_robot_keeps_off_the_side_that_a_rack_beside_the_person_blocks(side: float) -> None:
    person = (4.0, -side * 0.3, 0.7)  # this side would be nearer
    state = RobotState(0.0, (0.0, 0.0), 0.0, 0.4, 0.0)
    rack = sorted([side * 0.95, side * 3.0])
    assert side * headings_rad(state, person, [[3.0, rack[0], 5.0, rack[1]]], 10)[-1] < 0.0
