"""The reference planner: it takes the way that the limit, there and then, lets end soonest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planner_scenes import DT_S, constraints, drive

from nav_adapter import AwarenessPolicy, NavAdapter, RobotState
from sim_tests import run_crossing
from sim_tests.actors.robot import NOVA_CARTER
from sim_tests.crossing.planner import CostmapPlanner, ReferencePlanner
from tracking import PersonTrack

GOAL = np.array([10.0, 0.0])
HALL = np.array([[-6.0, 3.0, 20.0, 4.0], [-6.0, -4.0, 20.0, -3.0]])
AISLE = np.array([[-6.0, 1.95, 20.0, 3.0], [-6.0, -3.0, 20.0, -1.95]])
NARROW = np.array([[-6.0, 1.2, 20.0, 2.0], [-6.0, -2.0, 20.0, -1.2]])


def person(place, velocity=(0.0, 0.0), alpha=0.0, stamp_s=0.0, number=1):
    """Return somebody whose place and velocity are known well."""
    return PersonTrack(
        id=number,
        stamp_s=stamp_s,
        status="confirmed",
        position_odom_m=np.asarray(place),
        velocity_odom_mps=np.asarray(velocity),
        covariance_odom=np.diag([1e-4, 1e-4, 1e-4, 1e-4]),
        awareness=alpha,
        awareness_std=0.0,
        awareness_lower=alpha,
        height_m=1.75,
        time_since_seen_s=0.0,
    )


def drive_past(
    planner, place, velocity=(0.0, 0.0), alpha=0.0, turn_rad=0.0, seconds=6.0, stands_at=None
):
    """Return the states of a robot that starts at the origin, x to its goal, all of it turned.

    Somebody else, who has not noticed it, may stand farther on.
    """
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    turned = np.array([[c, -s], [s, c]])
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), NOVA_CARTER)
    state, states = RobotState(0.0, np.zeros(2), turn_rad, 0.0, 0.0), []
    for _ in range(round(seconds / DT_S)):
        now = state.stamp_s
        there = np.asarray(place) + now * np.asarray(velocity)
        people = [person(turned @ there, turned @ np.asarray(velocity), alpha, now)]
        if stands_at is not None:
            people.append(person(turned @ np.asarray(stands_at), stamp_s=now, number=2))
        limit = adapter.update(tuple(people), state, now)
        command = planner.plan(state, turned @ GOAL, limit, DT_S)
        state = drive(state, command)
        states.append(state)
    return states


@settings(max_examples=6, deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(-1.0, 1.0), st.floats(0.0, 1.0))
def test_a_turned_world_is_driven_through_likewise(turn_rad, y_m, alpha):
    straight, turned = (
        drive_past(planner, (4.0, y_m), alpha=alpha, turn_rad=each, seconds=2.0)[-1]
        for each in (0.0, turn_rad)
        for planner in [ReferencePlanner(NOVA_CARTER)]
    )
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    x_m, y_m = straight.position_odom_m
    place = c * x_m - s * y_m, s * x_m + c * y_m
    assert turned.position_odom_m == pytest.approx(place, abs=0.02)
    assert turned.speed_mps == pytest.approx(straight.speed_mps, abs=0.05)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_it_uses_the_room_that_it_has_beside_somebody_who_has_not_noticed(side):
    """It is aside before it is near, faster there, and soon farther than without a plan."""
    place = 5.0, 0.6 * side
    planned, unplanned = (
        drive_past(kind(NOVA_CARTER, HALL), place, seconds=9.0)
        for kind in (ReferencePlanner, CostmapPlanner)
    )
    before = next(each for each in planned if each.position_odom_m[0] > 3.5)
    assert side * before.position_odom_m[1] < -0.5
    assert planned[-1].position_odom_m[0] > unplanned[-1].position_odom_m[0] + 0.2


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_it_gives_somebody_who_looks_more_room_than_the_limit_asks_for(side):
    """They may set off all the same. The room costs next to no time."""
    states = drive_past(ReferencePlanner(NOVA_CARTER, HALL), (5.0, 1.2 * side), alpha=1.0)
    beside = next(each for each in states if each.position_odom_m[0] > 5.0)
    assert side * beside.position_odom_m[1] < -1.0
    assert beside.speed_mps > 0.95 * NOVA_CARTER.max_speed_mps
    assert states[-1].position_odom_m[0] > 7.5


@pytest.mark.parametrize("y_m", [0.0, -1.0])
def test_it_does_not_dawdle_beside_somebody_who_looks_if_the_way_is_blocked_farther_on(y_m):
    """The one in the way may leave at any time, so the robot should be there soon."""
    free_s, blocked_s = (
        next(
            each.stamp_s
            for each in drive_past(
                ReferencePlanner(NOVA_CARTER, AISLE), (5.0, 1.0), alpha=1.0, stands_at=place
            )
            if each.position_odom_m[0] > 5.0
        )
        for place in (None, (9.0, y_m))
    )
    assert blocked_s < free_s + 0.3


def test_where_there_is_no_room_it_keeps_clear_of_the_racks():
    states = drive_past(ReferencePlanner(NOVA_CARTER, NARROW), (5.0, 0.7), alpha=1.0, seconds=9.0)
    assert max(abs(each.position_odom_m[1]) for each in states) < 1.2 - 0.25
    assert states[-1].position_odom_m[0] > 7.0


def test_it_lets_somebody_cross_who_would_be_there_first():
    """It never stops: it is slower early, and there when they have passed."""
    states = drive_past(ReferencePlanner(NOVA_CARTER, HALL), (5.0, -4.0), (0.0, 1.2), seconds=7.0)
    moving = [each.speed_mps for each in states if each.stamp_s > 1.0]
    assert min(moving) > 0.2
    assert states[-1].position_odom_m[0] > 6.0


def test_it_passes_somebody_who_comes_towards_it_on_the_right():
    states = drive_past(ReferencePlanner(NOVA_CARTER, AISLE), (9.0, 0.0), (-1.2, 0.0))
    gap_m = [np.hypot(*(s.position_odom_m - (9.0 - 1.2 * s.stamp_s, 0.0))) for s in states]
    assert min(gap_m) > 0.75
    assert states[int(np.argmin(gap_m))].position_odom_m[1] < -0.7


@given(st.floats(0.0, 1.5), st.floats(-2.0, 2.0))
def test_it_keeps_the_limit(limit_mps, y_m):
    state = RobotState(0.0, np.zeros(2), 0.0, min(limit_mps, 0.5), 0.0)
    given = constraints([((4.0, y_m), (0.0, 1.0), 0.45)], limit_mps)
    speed_mps, _ = ReferencePlanner(NOVA_CARTER).plan(state, GOAL, given, DT_S)
    assert speed_mps <= max(limit_mps, 0.45) + 1e-9


def test_without_anybody_it_drives_as_without_a_limit_to_plan_with():
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), NOVA_CARTER)
    state = RobotState(0.0, np.zeros(2), 0.1, 0.7, 0.0)
    nobody = adapter.update((), state, 0.0)
    planned, alone = (
        ReferencePlanner(NOVA_CARTER, HALL).plan(state, GOAL, each, DT_S)
        for each in (nobody, constraints([]))
    )
    assert planned == alone


def test_a_new_goal_is_a_new_line():
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), NOVA_CARTER)
    planner = ReferencePlanner(NOVA_CARTER)
    state = RobotState(0.0, np.zeros(2), 0.0, 0.7, 0.0)
    limit = adapter.update((person((6.0, 6.0)),), state, 0.0)
    ahead = planner.plan(state, (8.0, 0.0), limit, DT_S)
    aside = planner.plan(state, (0.0, 8.0), limit, DT_S)
    assert abs(ahead[1]) < 0.1 < aside[1]


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [(71,), pytest.param((71, 72), marks=pytest.mark.full)])
def test_waits_of_both_are_shorter_and_nobody_is_touched(seeds):
    """Seeds that no constant was chosen on."""
    lasts_s = {"reference": 0.0, "costmap": 0.0}
    for name in ("turns_back", "stops_midway", "walking_backwards"):
        for seed in seeds:
            for planner in lasts_s:
                result = run_crossing(name, policy="balanced", planner=planner, seed=seed)
                assert planner == "costmap" or not result.contacts
                lasts_s[planner] += result.time_to_goal_s
    assert lasts_s["reference"] < lasts_s["costmap"]
